#include "core/localization/registration/pose_prior.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace atlas {

Pose LevelFrame(const Pose& T_world_sensor) {
  Pose level = Pose::Identity();
  const double yaw_rad = SplitYaw(Eigen::Quaterniond(T_world_sensor.linear())).yaw_rad;
  level.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  level.translation() = T_world_sensor.translation();
  return level;
}

PoseCovariance Turned(const Eigen::Matrix3d& R_to_from, const PoseCovariance& covariance) {
  Eigen::Matrix4d R = Eigen::Matrix4d::Identity();
  R.topLeftCorner<3, 3>() = R_to_from;
  return R * covariance * R.transpose();
}

Eigen::Vector4d PoseDifference(const Pose& from, const Pose& to) {
  Eigen::Vector4d difference;
  difference.head<3>() = to.translation() - from.translation();
  difference(3) = SplitYaw(Eigen::Quaterniond(to.linear() * from.linear().transpose())).yaw_rad;
  return difference;
}

bool AreApart(const Pose& a, const Pose& b, double apart_m, double apart_rad) {
  const Eigen::AngleAxisd turned(a.linear().transpose() * b.linear());
  return (a.translation() - b.translation()).norm() > apart_m || turned.angle() > apart_rad;
}

double LogDensity(const PosePrior& prior, const Pose& pose) {
  const Eigen::Vector4d offset = PoseDifference(prior.T_world_level, pose);
  return -0.5 * offset.dot(prior.covariance.ldlt().solve(offset));
}

bool IsWithin(const PosePrior& prior, const Pose& pose, double sigmas, double up_sigmas) {
  constexpr std::array<int, 3> kPlane{0, 1, 3};
  const Eigen::Vector4d off = PoseDifference(prior.T_world_level, pose);
  const Eigen::Vector3d in_plane = off(kPlane);
  const Eigen::Matrix3d plane = prior.covariance(kPlane, kPlane);
  return std::sqrt(in_plane.dot(plane.inverse() * in_plane)) <= sigmas &&
         std::abs(off(2)) <= up_sigmas * std::sqrt(prior.covariance(2, 2));
}

HorizontalSpread SpreadOf(const PoseCovariance& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(covariance.topLeftCorner<2, 2>());
  const auto sigma = [&](int i) {
    return std::sqrt(std::max(0.0, solver.eigenvalues()(i)));
  };
  return {sigma(1), sigma(0), solver.eigenvectors().col(1)};
}

}  // namespace atlas
