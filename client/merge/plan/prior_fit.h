// Where a part of a merge lies in the world, by positions that are known of its keyframes: turned
// about the vertical and shifted, robustly.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "client/merge/plan/merge_options.h"
#include "core/geometry/pose.h"

namespace atlas {

// A keyframe in the part's frame, and as it is known; metres.
struct KnownPair {
  Eigen::Vector3d p_part = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double radius_m = 0.0;  // one standard deviation along each axis
};

// How many pairs are as near as they may be where `T_world_part` has them: within 3 radii along
// each axis, as a ball, and `slack_m`.
std::size_t CountAgreeing(std::span<const KnownPair> pairs,
                          const Pose& T_world_part,
                          double slack_m);

// T_world_part that most pairs agree with. Of equal pairs the same on every run. None: less than
// `min_share` of them agree with any (PriorOptions), or those that do are too few or too near each
// other to tell the heading.
std::optional<Pose> FitToPriors(std::span<const KnownPair> pairs, const PriorOptions& options);

}  // namespace atlas
