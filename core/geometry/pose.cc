#include "core/geometry/pose.h"

#include <cmath>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kMaxHorizontal_m = 1e7;
constexpr double kMaxVertical_m = 2e4;
constexpr double kQuaternionScale = 1 << QuantizedPose::kQuaternionBits;

bool IsInRange(const Eigen::Vector3d& p) {
  return std::abs(p.x()) <= kMaxHorizontal_m && std::abs(p.y()) <= kMaxHorizontal_m &&
         std::abs(p.z()) <= kMaxVertical_m;
}

Status PositionOutOfRange(const Eigen::Vector3d& p) {
  return Status(StatusCode::kInvalidData, StrCat("pose: position (", p.x(), ", ", p.y(), ", ",
                                                 p.z(), ") m is outside +-10000 km, +-20 km in z"));
}

}  // namespace

Result<Pose> PoseFromRowMajor(std::span<const double, 12> values) {
  Eigen::Matrix<double, 3, 4> m;
  for (int i = 0; i < 12; ++i) {
    const double value = values[static_cast<std::size_t>(i)];
    if (!std::isfinite(value)) {
      return Error(StatusCode::kInvalidData, StrCat("pose: number ", i + 1, " is not finite"));
    }
    m(i / 4, i % 4) = value;
  }
  const Eigen::Matrix3d rotation = m.leftCols<3>();
  const double deviation =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (deviation > 1e-3 || rotation.determinant() < 0.0) {
    return Error(StatusCode::kInvalidData,
                 StrCat("pose: the 3x3 part is not a rotation (off by ", deviation,
                        ", determinant ", rotation.determinant(), ")"));
  }
  const Eigen::Vector3d position = m.col(3);
  if (!IsInRange(position)) {
    return Error(PositionOutOfRange(position));
  }
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  pose.translation() = position;
  return pose;
}

std::array<double, 12> PoseToRowMajor(const Pose& pose) {
  std::array<double, 12> values{};
  for (int i = 0; i < 12; ++i) {
    values[static_cast<std::size_t>(i)] = pose.matrix()(i / 4, i % 4);
  }
  return values;
}

QuantizedPose QuantizedPose::FromPose(const Pose& pose) {
  QuantizedPose result;
  const Eigen::Vector3d um = pose.translation() * 1e6;
  result.x_um = std::llround(um.x());
  result.y_um = std::llround(um.y());
  result.z_um = std::llround(um.z());
  Eigen::Quaterniond q(pose.linear());
  q.normalize();
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const std::array<double, 4> parts{q.w(), q.x(), q.y(), q.z()};
  for (std::size_t i = 0; i < 4; ++i) {
    result.quaternion[i] =
        static_cast<std::int32_t>(std::lround(sign * parts[i] * kQuaternionScale));
  }
  return result;
}

Pose QuantizedPose::ToPose() const {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(quaternion[0], quaternion[1], quaternion[2], quaternion[3])
                      .normalized()
                      .toRotationMatrix();
  pose.translation() = 1e-6 * Eigen::Vector3d(static_cast<double>(x_um), static_cast<double>(y_um),
                                              static_cast<double>(z_um));
  return pose;
}

Status QuantizedPose::Validate() const {
  double squared = 0.0;
  for (const std::int32_t part : quaternion) {
    squared += static_cast<double>(part) * part;
  }
  const double length = std::sqrt(squared) / kQuaternionScale;
  if (std::abs(length - 1.0) > 1e-6) {
    return Status(StatusCode::kInvalidData, StrCat("pose: quaternion has length ", length));
  }
  const Eigen::Vector3d position =
      1e-6 * Eigen::Vector3d(static_cast<double>(x_um), static_cast<double>(y_um),
                             static_cast<double>(z_um));
  return IsInRange(position) ? Status() : PositionOutOfRange(position);
}

YawAndLevel SplitYaw(const Eigen::Quaterniond& R_world_sensor) {
  // Twist about z: the quaternion's projection on (w, z). Upside down (w = z = 0) has no yaw; the
  // sensor is then turned about x by half a turn and any yaw would do.
  const double norm = std::hypot(R_world_sensor.w(), R_world_sensor.z());
  YawAndLevel split;
  if (norm > 1e-12) {
    const Eigen::Quaterniond twist(R_world_sensor.w() / norm, 0.0, 0.0, R_world_sensor.z() / norm);
    split.yaw_rad = 2.0 * std::atan2(twist.z(), twist.w());
    split.R_level_sensor = twist.conjugate() * R_world_sensor;
  } else {
    split.R_level_sensor = R_world_sensor;
  }
  return split;
}

}  // namespace atlas
