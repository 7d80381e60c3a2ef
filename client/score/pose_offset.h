// An error taken apart as a driver would say it, and measured against what was claimed about it.
#pragma once

#include <Eigen/Core>

#include "core/geometry/pose.h"

namespace atlas {

// Where an estimate lies as seen from the truth: along its heading, to the left of it, upwards.
struct PoseOffset {
  double along_m = 0.0;
  double left_m = 0.0;
  double up_m = 0.0;
  double yaw_rad = 0.0;  // (-pi, pi]

  Eigen::Vector4d vector() const { return {along_m, left_m, up_m, yaw_rad}; }
};
PoseOffset OffsetOf(const Pose& estimate, const Pose& truth);

// A covariance of (x, y, z, yaw) in world axes, turned to (along, left, up, yaw) of `truth`.
Eigen::Matrix4d AlongHeading(const Eigen::Matrix4d& covariance, const Pose& truth);

// e' C^-1 e, the normalised error squared: of an honest covariance it is chi-squared with four
// degrees of freedom, 4 on average, and at most kWithin95 in 95 % of all cases. Infinite for a
// covariance that is not positive definite.
double NormalizedSquare(const PoseOffset& offset, const Eigen::Matrix4d& covariance);
inline constexpr int kOffsetFreedoms = 4;
inline constexpr double kWithin95 = 9.4877;  // the 95 % quantile

}  // namespace atlas
