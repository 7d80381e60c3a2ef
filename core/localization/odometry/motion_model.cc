#include "core/localization/odometry/motion_model.h"

#include <Eigen/LU>

namespace atlas {
namespace {

Eigen::Vector4d Squares(double a, double b, double c, double d) {
  return {a * a, b * b, c * c, d * d};
}

Eigen::Matrix3d TurnAboutVertical(double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

Eigen::Vector4d UnknownMotion(const MotionOptions& options) {
  return Squares(options.ahead_m, options.beside_m, options.up_m, options.turn_rad);
}

}  // namespace

MotionModel::MotionModel(const MotionOptions& options) : options_(options) {}

void MotionModel::Start(const Pose& T_world_sensor, const PoseCovariance& covariance) {
  pose_ = T_world_sensor;
  covariance_.setZero();
  covariance_.topLeftCorner<4, 4>() = covariance;
  ForgetMotion();
}

void MotionModel::Start(const Pose& T_world_sensor) {
  Start(T_world_sensor,
        Squares(options_.start_m, options_.start_m, options_.start_m, options_.start_rad)
            .asDiagonal());
}

void MotionModel::ForgetMotion() {
  motion_.setZero();
  covariance_.topRightCorner<4, 4>().setZero();
  covariance_.bottomLeftCorner<4, 4>().setZero();
  covariance_.bottomRightCorner<4, 4>() = UnknownMotion(options_).asDiagonal();
}

Eigen::Matrix4d MotionModel::PlaceByMotion(const Pose& from, double scans) const {
  const Eigen::Matrix3d R = TurnAboutVertical(0.5 * scans * motion_(3)) * from.linear();
  const Eigen::Vector3d step = scans * R * motion_.head<3>();
  Eigen::Matrix4d by_motion = Eigen::Matrix4d::Zero();
  by_motion.topLeftCorner<3, 3>() = scans * R;
  by_motion.topRightCorner<3, 1>() = 0.5 * scans * Eigen::Vector3d::UnitZ().cross(step);
  by_motion(3, 3) = scans;
  return by_motion;
}

void MotionModel::Predict(double scans) {
  last_ = pose_;
  since_ = scans;
  const Eigen::Matrix4d by_motion = PlaceByMotion(pose_, scans);
  const Eigen::Vector3d step = by_motion.topLeftCorner<3, 3>() * motion_.head<3>();
  Matrix8d F = Matrix8d::Identity();
  F.block<3, 1>(0, 3) = Eigen::Vector3d::UnitZ().cross(step);  // d step / d yaw
  F.topRightCorner<4, 4>() = by_motion;
  covariance_.bottomRightCorner<4, 4>().diagonal() +=
      scans * scans *
      Squares(options_.ahead_change_m, options_.beside_change_m, options_.up_change_m,
              options_.turn_change_rad);
  covariance_ = F * covariance_ * F.transpose();
  pose_.translation() += step;
  pose_.linear() = TurnAboutVertical(scans * motion_(3)) * pose_.linear();
}

Pose MotionModel::T_now_later() const {
  const Eigen::Matrix3d& R_world_sensor = pose_.linear();
  Pose T_now_later = Pose::Identity();
  T_now_later.linear() =
      R_world_sensor.transpose() * TurnAboutVertical(motion_(3)) * R_world_sensor;
  T_now_later.translation() = R_world_sensor.transpose() * TurnAboutVertical(0.5 * motion_(3)) *
                              R_world_sensor * motion_.head<3>();
  return T_now_later;
}

PoseCovariance MotionModel::CovarianceOfStep(const Pose& from, double scans) const {
  const Eigen::Matrix4d by_motion = PlaceByMotion(from, scans);
  return by_motion * covariance_.bottomRightCorner<4, 4>() * by_motion.transpose();
}

void MotionModel::Carry(const Pose& T_world_sensor, const PoseCovariance& covariance) {
  Eigen::Matrix<double, 4, 8> H = Eigen::Matrix<double, 4, 8>::Zero();
  H.rightCols<4>() = PlaceByMotion(last_, since_);
  const Eigen::Matrix4d step = StepCovariance() + covariance;
  const Eigen::Matrix<double, 8, 4> gain = covariance_ * H.transpose() * step.inverse();
  const Eigen::Matrix<double, 8, 1> change = gain * PoseDifference(pose_, T_world_sensor);
  pose_.translation() += change.head<3>();
  pose_.linear() = TurnAboutVertical(change(3)) * pose_.linear();
  motion_ += change.tail<4>();
  // Joseph's form: hundreds of steps without a place in the map leave it a covariance.
  const Matrix8d left = Matrix8d::Identity() - gain * H;
  covariance_ =
      (left * covariance_ * left.transpose() + gain * covariance * gain.transpose()).eval();
}

void MotionModel::Correct(const Pose& T_world_sensor, const Eigen::Matrix4d& seen) {
  const Eigen::Matrix4d prior = covariance_.topLeftCorner<4, 4>();
  const Eigen::Matrix4d posterior = (prior.inverse() + seen).inverse();
  const Eigen::Matrix4d motion_by_pose = covariance_.bottomLeftCorner<4, 4>() * prior.inverse();
  motion_ += motion_by_pose * PoseDifference(pose_, T_world_sensor);
  covariance_.bottomRightCorner<4, 4>() -=
      motion_by_pose * (prior - posterior) * motion_by_pose.transpose();
  covariance_.bottomLeftCorner<4, 4>() = motion_by_pose * posterior;
  covariance_.topRightCorner<4, 4>() = covariance_.bottomLeftCorner<4, 4>().transpose();
  covariance_.topLeftCorner<4, 4>() = posterior;
  pose_ = T_world_sensor;
}

void MotionModel::Turn(const Pose& T_world_sensor, const Eigen::Matrix4d& seen) {
  Relocate(T_world_sensor, seen);
  const Eigen::Vector4d difference = PoseDifference(last_, T_world_sensor);
  motion_.head<3>() =
      (TurnAboutVertical(0.5 * difference(3)) * last_.linear()).transpose() * difference.head<3>();
  motion_(3) = difference(3);
  motion_ /= since_;
  covariance_.bottomRightCorner<4, 4>() =
      Squares(options_.ahead_surprise_m, options_.beside_surprise_m, options_.up_surprise_m,
              options_.turn_surprise_rad)
          .asDiagonal();
}

void MotionModel::Relocate(const Pose& T_world_sensor, const Eigen::Matrix4d& seen) {
  Start(T_world_sensor);
  const Eigen::Matrix4d prior = covariance();
  covariance_.topLeftCorner<4, 4>() = (prior.inverse() + seen).inverse();
}

void MotionModel::Widen(const Eigen::Vector4d& strayed) {
  covariance_.diagonal().head<4>() += strayed.cwiseAbs2();
}

void MotionModel::SetTilt(const Eigen::Matrix3d& R_world_sensor) {
  pose_.linear() = R_world_sensor;
}

}  // namespace atlas
