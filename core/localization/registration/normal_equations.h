// The normal equations of a pose's change (translation t, rotation vector w, both in world axes,
// about the sensor): a point at `arm` from the sensor moves by t + w x arm.
#pragma once

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/pose_prior.h"

namespace atlas {

struct NormalEquations {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  Matrix6 H = Matrix6::Zero();  // its lower half
  Vector6 g = Vector6::Zero();

  // Residual along the unit vector `direction` (world) of a point at `arm` from the sensor.
  void Add(const Eigen::Vector3d& direction,
           const Eigen::Vector3d& arm,
           double residual,
           double weight);
  // The levelled frame is upright within the IMU's error: roll and pitch stay near 0.
  void AddTiltPrior(const Pose& pose, double sigma_rad);
  // `information`: of `expected`, the inverse of its covariance (PosePrior).
  void AddPrior(const Pose& pose, const Pose& expected, const Eigen::Matrix4d& information);

  NormalEquations& operator*=(double weight);
  NormalEquations& operator+=(const NormalEquations& other);
  // What brings the gradient to zero.
  Vector6 Solve() const;
};

Pose Moved(const Pose& pose, const NormalEquations::Vector6& step);

}  // namespace atlas
