// Where a vehicle is expected, and how surely.
#pragma once

#include <variant>

#include <Eigen/Core>

#include "core/geometry/pose.h"

namespace atlas {

// Of (x, y, z, yaw): world axes, metres and radians. Tilt is the IMU's.
using PoseCovariance = Eigen::Matrix4d;

struct PosePrior {
  Pose T_world_level = Pose::Identity();
  PoseCovariance covariance = PoseCovariance::Zero();
};

// Where about a vehicle starts, right to so much: along the world's x and y, and in heading; on the
// right deck. The scan is believed where they differ.
struct StartHint {
  double within_m = 3.0;
  double within_rad = 0.35;
};

// How well a start is known: a hint, or believed as far as its covariance, positive definite, says.
using StartKnowledge = std::variant<StartHint, PoseCovariance>;

// T_world_sensor without its tilt.
Pose LevelFrame(const Pose& T_world_sensor);
// Along the axes of a frame that is `R_to_from` to those it is given along.
PoseCovariance Turned(const Eigen::Matrix3d& R_to_from, const PoseCovariance& covariance);

// (x, y, z, yaw) that take `from` to `to`.
Eigen::Vector4d PoseDifference(const Pose& from, const Pose& to);

// Whether they are further from each other than this in place, or turned by more.
bool AreApart(const Pose& a, const Pose& b, double apart_m, double apart_rad);

// Log of the prior's density at `pose`, up to its constant.
double LogDensity(const PosePrior& prior, const Pose& pose);

// Whether `pose` is within so many of its standard deviations: of (x, y, yaw) in all, and of the
// height.
bool IsWithin(const PosePrior& prior, const Pose& pose, double sigmas, double up_sigmas);

// A place's uncertainty in the plane, standard deviations.
struct HorizontalSpread {
  double along_m = 0.0;   // in the direction in which it is least certain
  double beside_m = 0.0;  // across it
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();
};
HorizontalSpread SpreadOf(const PoseCovariance& covariance);

}  // namespace atlas
