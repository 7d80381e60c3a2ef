#include "core/localization/odometry/own_motion.h"

namespace atlas {
namespace {

// However well scans fit to each other, standard deviations.
constexpr double kStep_m = 0.05;
constexpr double kStepUp_m = 0.03;
constexpr double kStep_rad = 0.004;

}  // namespace

void OwnMotion::Begin(const ScanFeatures& features) {
  motion_.Start(Pose::Identity(), PoseCovariance::Zero());
  recent_.Clear();
  recent_.Add(features, Pose::Identity());
}

OwnStep OwnMotion::Next(const ScanFeatures& features, double scans) {
  if (scans > pause_.most_predicted) motion_.ForgetMotion();
  const Pose last = motion_.T_world_sensor();
  motion_.Predict(scans);
  const PosePrior expected{motion_.T_world_sensor(), motion_.StepCovariance()};
  ScanMotion moved = MotionSince(recent_, features, expected, odometry_);
  if (scans > pause_.most_missing) {  // it may have stood meanwhile
    const ScanMotion stood =
        MotionSince(recent_, features, {last, PoseCovariance::Zero()}, odometry_);
    if (stood.fit >= moved.fit - odometry_.as_good_fit) moved = stood;
  }
  if (moved.fit < odometry_.min_fit) {
    Begin(features);
    return {};
  }
  const Eigen::Vector4d sigmas(kStep_m, kStep_m, kStepUp_m, kStep_rad);
  const PoseCovariance covariance =
      moved.covariance + PoseCovariance(sigmas.cwiseAbs2().asDiagonal());
  motion_.Carry(moved.T_world_level, covariance);
  recent_.Add(features, motion_.T_world_sensor());
  const Pose T_last_world = last.inverse();
  return {T_last_world * motion_.T_world_sensor(), Turned(T_last_world.linear(), covariance), true,
          moved.is_clear && moved.fit >= odometry_.sure_fit};
}

}  // namespace atlas
