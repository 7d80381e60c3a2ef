// Places that one scan may have been taken at, and whether one of them is it.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/registration.h"

namespace atlas {

struct HypothesisOptions {
  // Neighbouring features err together: a feature counts as this much of one in a log likelihood.
  double evidence_share = 0.2;
  // A place is believed when it is this much likelier than where the vehicle was tracked to, and
  // than any other place: log ratios.
  double believed_log_ratio = 2.0;
  double unique_log_ratio = 1.0;
  // So far from each other, in place or in heading, two are not the same.
  double apart_m = 1.0;
  double apart_rad = 0.07;
};

// A place, and how likely it is, up to a constant.
struct PlaceHypothesis {
  RegistrationResult registration;
  double log_likelihood = 0.0;
};

inline bool IsLessLikely(const PlaceHypothesis& a, const PlaceHypothesis& b) {
  return a.log_likelihood < b.log_likelihood;
}

// Whether both are the same, by HypothesisOptions.
bool IsSamePlace(const Pose& a, const Pose& b, const HypothesisOptions& options);

// From `best` to the likeliest other place that is about as likely, in the plane: the vehicle may
// have moved on by one of a row of posts.
std::optional<Eigen::Vector2d> RivalOf(const std::vector<PlaceHypothesis>& places,
                                       const PlaceHypothesis& best,
                                       const HypothesisOptions& options);

// Whether `best` is likelier than the first of `places`, where the vehicle was tracked to, and than
// any other place.
bool StandsOut(const std::vector<PlaceHypothesis>& places,
               const PlaceHypothesis& best,
               const HypothesisOptions& options);

}  // namespace atlas
