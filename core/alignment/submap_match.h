// How two submaps fit onto each other: each one's features are registered in the other's map, and
// both have to come to the same answer.
#pragma once

#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/alignment/submap.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "core/localization/registration/pose_search.h"
#include "core/localization/registration/registration.h"
#include "core/localization/window/map_window.h"

namespace atlas {

// Raised when submaps or matches come out otherwise than before: what was kept is forgotten then.
inline constexpr std::uint64_t kAlignmentRules = 2;

struct MatchOptions {
  PlaceOptions window;
  RegistrationOptions registration;
  PoseSearchOptions search = {.step_m = 0.4, .max_columns = 160, .candidates = 3};
  float coarse_block_m = 0.4F;

  // A feature is not looked for in the other's map
  // - if what it shows is turned away from all places where the other vehicle was, or nearly: it
  //   looks to where, so far around it, something is free, and by less than this cosine to any of
  //   them. Who was there saw the other side, which lies as far off as the object is thick, and
  //   would be pulled onto this one;
  float facing_reach_m = 0.25F;
  float min_facing = 0.3F;
  // - if it is of something flat, around which, so far off, as much stands in so many of eight
  //   directions: of a ceiling each vehicle sees what is around itself, and these are not the same.
  float flat_reach_m = 0.4F;
  int flat_directions = 4;

  // Both ways: how well mapped features fit, which share of the columns stands on structure, how
  // certain the place is in its worst horizontal direction, were features independent.
  double min_fit = 0.6;
  double min_columns = 0.3;
  double max_sigma_m = 0.02;
  // Between the two answers.
  double max_apart_m = 0.1;
  double max_apart_rad = 0.5 * std::numbers::pi / 180.0;
};

// A submap as others are registered in it. The submap outlives it; one thread at a time.
class SubmapWindow {
 public:
  // kInvalidData as the submap's tiles.
  static Result<SubmapWindow> Make(const Submap& submap,
                                   const MapProfile& profile,
                                   const MatchOptions& options);

  const Submap& submap() const { return *submap_; }
  const MapWindow& window() const { return window_; }
  const CoarseOccupancy& coarse();  // made when first asked for
  // Of the submap's features those that are not flat, nor turned away from all of `places` (submap
  // frame), and its ground.
  ScanFeatures SeenFrom(const std::vector<Eigen::Vector3d>& places,
                        const MatchOptions& options) const;

 private:
  SubmapWindow(const Submap& submap, const MapProfile& profile, const MatchOptions& options)
      : submap_(&submap),
        window_(profile, options.window),
        coarse_block_m_(options.coarse_block_m) {}

  // Points in the submap's frame.
  bool IsFlat(const Eigen::Vector3f& p, const MatchOptions& options) const;
  // Where something around it is free, as far as that is one side; else 0.
  Eigen::Vector2f FacingOf(const Eigen::Vector3f& p, const MatchOptions& options) const;

  const Submap* submap_;
  ScanFeatures upright_;  // those that are not flat, and the ground
  // As many as those, of unit length or 0.
  std::vector<Eigen::Vector2f> columns_facing_;
  std::vector<Eigen::Vector2f> returns_facing_;
  MapWindow window_;
  float coarse_block_m_;
  std::optional<CoarseOccupancy> coarse_;
};

struct SubmapMatch {
  Pose T_a_b = Pose::Identity();  // midway between the two answers
  // Of both ways together, as far as features are independent: (translation, rotation vector) in
  // 1/m^2 and 1/rad^2, axes of a, about b's origin.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  // The worse of both ways.
  double fit = 0.0;
  double columns = 0.0;    // share of columns on structure
  double explained = 0.0;  // share of columns that are explained, less contradictions
  double sigma_m = 0.0;    // WorstSigma
  // Between the two answers.
  double apart_m = 0.0;
  double apart_rad = 0.0;
};

// From nearby: as far as registrations reach, half a metre and some degrees. Always an answer;
// IsBelieved tells whether it is one. Where b does not fit into a (min_fit, min_columns), a is not
// tried in b: nothing is believed then, and what it says is of the one way.
SubmapMatch MatchSubmaps(const SubmapWindow& a,
                         const SubmapWindow& b,
                         const Pose& T_a_b_start,
                         const MatchOptions& options);
bool IsBelieved(const SubmapMatch& match, const MatchOptions& options);

// T_a_b: where b may lie in a around a start, by how many of its columns fall on structure, the
// best first; none where b has too few columns.
std::vector<Pose> SearchSubmap(SubmapWindow& a,
                               const Submap& b,
                               const Pose& T_a_b_start,
                               const SearchReach& reach,
                               const MatchOptions& options);

}  // namespace atlas
