#include "core/localization/tracking/place_hypotheses.h"

#include <algorithm>

#include "core/localization/registration/pose_prior.h"

namespace atlas {

bool IsSamePlace(const Pose& a, const Pose& b, const HypothesisOptions& options) {
  return !AreApart(a, b, options.apart_m, options.apart_rad);
}

std::optional<Eigen::Vector2d> RivalOf(const std::vector<PlaceHypothesis>& places,
                                       const PlaceHypothesis& best,
                                       const HypothesisOptions& options) {
  const Pose& pose = best.registration.T_world_level;
  std::optional<Eigen::Vector2d> rival;
  double likeliest = best.log_likelihood - options.unique_log_ratio;
  for (const PlaceHypothesis& other : places) {
    const Pose& elsewhere = other.registration.T_world_level;
    if (other.log_likelihood > likeliest && !IsSamePlace(elsewhere, pose, options)) {
      likeliest = other.log_likelihood;
      rival = (elsewhere.translation() - pose.translation()).head<2>();
    }
  }
  return rival && rival->norm() > 0.0 ? rival : std::nullopt;
}

bool StandsOut(const std::vector<PlaceHypothesis>& places,
               const PlaceHypothesis& best,
               const HypothesisOptions& options) {
  const bool is_likelier =
      best.log_likelihood > places.front().log_likelihood + options.believed_log_ratio;
  return is_likelier &&
         std::none_of(places.begin() + 1, places.end(), [&](const PlaceHypothesis& other) {
           return other.log_likelihood > best.log_likelihood - options.unique_log_ratio &&
                  !IsSamePlace(other.registration.T_world_level, best.registration.T_world_level,
                               options);
         });
}

}  // namespace atlas
