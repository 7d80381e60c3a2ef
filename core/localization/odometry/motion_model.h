// Where the vehicle is expected at the next scan, and how surely: a Kalman filter of its pose and
// of its motion from scan to scan (constant twist in the sensor's frame). A direction that no scan
// held keeps the speed it had; one that was never held is as uncertain as a vehicle's speed can be.
#pragma once

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/pose_prior.h"

namespace atlas {

// Standard deviations; motions are per scan, x of the sensor's frame is ahead.
struct MotionOptions {
  double start_m = 0.5;  // of the first pose
  double start_rad = 0.03;
  // Of the motion before anything is known of it: 25 m/s at ten scans a second are 2.5 m. Vehicles
  // do not drive sideways.
  double ahead_m = 2.0;
  double beside_m = 0.2;
  double up_m = 0.2;
  double turn_rad = 0.1;
  // How much the motion changes from one scan to the next; where some are missing, as many times
  // as much.
  double ahead_change_m = 0.1;
  double beside_change_m = 0.03;
  double up_change_m = 0.05;
  double turn_change_rad = 0.02;
  // ... and how much after a scan that showed a motion nobody expected.
  double ahead_surprise_m = 0.3;
  double beside_surprise_m = 0.1;
  double up_surprise_m = 0.1;
  double turn_surprise_rad = 0.2;
};

// Where scans are missing.
struct PauseOptions {
  // More than so many: the vehicle may have stood meanwhile (a recorder that waits at a red light
  // with it). More than that: nothing is known of its motion.
  double most_missing = 5.0;
  double most_predicted = 20.0;
  // Fewer: their times may be wrong, by this, standard deviation, of a usual interval. Where a
  // whole number of them leads so far from where the told time does, the scan tells which it was:
  // by how well it fits near there and, where it is found at one place from all of them, by how far
  // from there, standard deviations. Where the speed is not known as well as this, a scan, standard
  // deviation, it is a whole number.
  double sigma = 0.5;
  double apart_m = 0.15;
  double apart_rad = 0.03;
  double off_m = 0.15;
  double off_rad = 0.1;
  double known_m = 0.5;
};

class MotionModel {
 public:
  explicit MotionModel(const MotionOptions& options);

  // Forgets all motion: the vehicle stands at `T_world_sensor`, as uncertain as that, or as a start
  // is.
  void Start(const Pose& T_world_sensor, const PoseCovariance& covariance);
  void Start(const Pose& T_world_sensor);
  // To the next scan, after so many times the usual time between two: some may be missing.
  void Predict(double scans = 1.0);
  // What was seen of the way from the last scan to this one, behind Predict(): the motion follows,
  // and the place with it. `covariance`: of (x, y, z, yaw) of that step.
  void Carry(const Pose& T_world_sensor, const PoseCovariance& covariance);
  // All three: the scan placed the vehicle, prior included, and `seen` is the scan's information
  // about (x, y, z, yaw).
  // As predicted, more or less: speeds follow as far as they are correlated with the place.
  void Correct(const Pose& T_world_sensor, const Eigen::Matrix4d& seen);
  // It turned or braked as nobody expected, from the last scan to this one.
  void Turn(const Pose& T_world_sensor, const Eigen::Matrix4d& seen);
  // It is elsewhere than its motion can tell: the motion is forgotten.
  void Relocate(const Pose& T_world_sensor, const Eigen::Matrix4d& seen);

  // The vehicle stopped as far as anyone knows; its place stays as uncertain as it is.
  void ForgetMotion();
  // It is on another deck, so much higher; all else is as it was.
  void Raise(double up_m) { pose_.translation().z() += up_m; }
  // It may have strayed by so much in (x, y, z, yaw), either way.
  void Widen(const Eigen::Vector4d& strayed);
  // The IMU's tilt; the place and the heading stay.
  void SetTilt(const Eigen::Matrix3d& R_world_sensor);

  const Pose& T_world_sensor() const { return pose_; }
  const Pose& last() const { return last_; }  // before Predict()
  // (x, y, z, yaw) from where it was before Predict() to there.
  Eigen::Vector4d LastStep(const Pose& T_world_sensor) const {
    return PoseDifference(last_, T_world_sensor);
  }
  // How uncertain that step is, by what is known of the motion.
  PoseCovariance StepCovariance() const { return CovarianceOfStep(last_, since_); }
  // From one scan to the next, as it is known: identity while nothing is.
  Pose T_now_later() const;
  // How uncertain that is: of (x, y, z, yaw) of it, along the world's axes.
  PoseCovariance MotionCovariance() const { return CovarianceOfStep(pose_, 1.0); }
  PoseCovariance covariance() const { return covariance_.topLeftCorner<4, 4>(); }

 private:
  using Matrix8d = Eigen::Matrix<double, 8, 8>;

  // What a change of the motion makes of the place so many scans later.
  Eigen::Matrix4d PlaceByMotion(const Pose& from, double scans) const;
  PoseCovariance CovarianceOfStep(const Pose& from, double scans) const;

  MotionOptions options_;
  Pose pose_ = Pose::Identity();
  Pose last_ = Pose::Identity();  // before Predict(),
  double since_ = 1.0;            // scans ago
  // Per scan, sensor frame: x, y, z, turn about the vertical.
  Eigen::Vector4d motion_ = Eigen::Vector4d::Zero();
  Matrix8d covariance_ = Matrix8d::Zero();  // of (x, y, z, yaw) and motion_
};

}  // namespace atlas
