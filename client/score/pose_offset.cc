#include "client/score/pose_offset.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>

namespace atlas {
namespace {

double YawOf(const Pose& pose) {
  return SplitYaw(Eigen::Quaterniond(pose.linear())).yaw_rad;
}

Eigen::Matrix3d AboutVertical(double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace

PoseOffset OffsetOf(const Pose& estimate, const Pose& truth) {
  const Eigen::Vector3d moved =
      AboutVertical(-YawOf(truth)) * (estimate.translation() - truth.translation());
  const double turned_rad = std::remainder(YawOf(estimate) - YawOf(truth), 2.0 * std::numbers::pi);
  return {moved.x(), moved.y(), moved.z(), turned_rad};
}

Eigen::Matrix4d AlongHeading(const Eigen::Matrix4d& covariance, const Pose& truth) {
  Eigen::Matrix4d turn = Eigen::Matrix4d::Identity();
  turn.topLeftCorner<3, 3>() = AboutVertical(-YawOf(truth));
  return turn * covariance * turn.transpose();
}

double NormalizedSquare(const PoseOffset& offset, const Eigen::Matrix4d& covariance) {
  const Eigen::LLT<Eigen::Matrix4d> root(covariance);
  if (root.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  return offset.vector().dot(root.solve(offset.vector()));
}

}  // namespace atlas
