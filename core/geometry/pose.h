// Rigid poses: as doubles where they are computed with, as integers where they are agreed on.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <Eigen/Geometry>

#include "core/base/status.h"

namespace atlas {

// T_to_from as a 4x4 isometry, metres.
using Pose = Eigen::Isometry3d;

// From 12 numbers, 3x4 row-major (KITTI). kInvalidData when a number is not finite, when the 3x3
// part is not a rotation within 1e-3, or when the position is outside +-10,000 km (+-20 km in z).
// The rotation is made exactly orthonormal.
Result<Pose> PoseFromRowMajor(std::span<const double, 12> values);
std::array<double, 12> PoseToRowMajor(const Pose& pose);

// A pose as it is accepted, stored and fused: nothing floating beyond this point.
struct QuantizedPose {
  static constexpr int kQuaternionBits = 30;

  std::int64_t x_um = 0;  // T_world_sensor translation
  std::int64_t y_um = 0;
  std::int64_t z_um = 0;
  std::array<std::int32_t, 4> quaternion{1 << kQuaternionBits, 0, 0, 0};  // w x y z, w >= 0, x 2^30

  friend bool operator==(const QuantizedPose&, const QuantizedPose&) = default;

  // Requires a pose within the limits of PoseFromRowMajor.
  static QuantizedPose FromPose(const Pose& pose);
  Pose ToPose() const;
  // kInvalidData when the quaternion's length is not 1 within 1e-6 or the position is out of range.
  Status Validate() const;
};

// Splits R_world_sensor = R_z(yaw) * R_level: the levelling rotation R_level turns the sensor frame
// into the gravity-levelled frame and has no turn about the vertical (swing-twist decomposition).
struct YawAndLevel {
  double yaw_rad = 0.0;
  Eigen::Quaterniond R_level_sensor = Eigen::Quaterniond::Identity();
};
YawAndLevel SplitYaw(const Eigen::Quaterniond& R_world_sensor);

}  // namespace atlas
