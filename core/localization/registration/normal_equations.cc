#include "core/localization/registration/normal_equations.h"

#include <array>

#include <Eigen/Cholesky>

namespace atlas {
namespace {

// Of a pose's (x, y, z, yaw) among the six unknowns.
constexpr std::array<int, 4> kPriorAxes{0, 1, 2, 5};

}  // namespace

void NormalEquations::Add(const Eigen::Vector3d& direction,
                          const Eigen::Vector3d& arm,
                          double residual,
                          double weight) {
  Vector6 J;
  J.head<3>() = direction;
  J.tail<3>() = arm.cross(direction);
  H.selfadjointView<Eigen::Lower>().rankUpdate(J, weight);
  g += weight * residual * J;
}

void NormalEquations::AddTiltPrior(const Pose& pose, double sigma_rad) {
  const Eigen::Vector3d up = pose.linear().col(2);
  const double weight = 1.0 / (sigma_rad * sigma_rad);
  for (int axis = 3; axis < 5; ++axis) {
    // A rotation w turns the vertical by w x up: about x it moves y by -w.
    const double tilt = axis == 3 ? -up.y() : up.x();
    H(axis, axis) += weight;
    g(axis) += weight * tilt;
  }
}

void NormalEquations::AddPrior(const Pose& pose,
                               const Pose& expected,
                               const Eigen::Matrix4d& information) {
  g(kPriorAxes) += information * PoseDifference(expected, pose);
  H(kPriorAxes, kPriorAxes) += information;
}

NormalEquations& NormalEquations::operator*=(double weight) {
  H *= weight;
  g *= weight;
  return *this;
}

NormalEquations& NormalEquations::operator+=(const NormalEquations& other) {
  H += other.H;
  g += other.g;
  return *this;
}

NormalEquations::Vector6 NormalEquations::Solve() const {
  const Matrix6 full = H.selfadjointView<Eigen::Lower>();
  return full.ldlt().solve(-g);
}

Pose Moved(const Pose& pose, const NormalEquations::Vector6& step) {
  Pose moved = pose;
  moved.translation() += step.head<3>();
  const double angle = step.tail<3>().norm();
  if (angle > 0.0) {
    moved.linear() =
        Eigen::AngleAxisd(angle, step.tail<3>() / angle).toRotationMatrix() * pose.linear();
  }
  return moved;
}

}  // namespace atlas
