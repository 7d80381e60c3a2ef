#include "client/drive/localization_trial.h"

#include <cmath>
#include <numbers>

#include "core/base/hash_random.h"

namespace atlas {
namespace {

constexpr double kStartHeightError_m = 0.2;

// One stream for the tilt, one for the start, one for a height: none depends on the number of
// draws of another.
HashRandom Stream(const TrialSeed& seed, std::uint64_t purpose) {
  return HashRandom(seed.seed, (std::uint64_t{seed.scan} << 32) | seed.trial, purpose);
}

}  // namespace

Eigen::Quaterniond DisturbedLevel(const Pose& T_world_sensor,
                                  double tilt_error_rad,
                                  const TrialSeed& seed) {
  HashRandom random = Stream(seed, 1);
  const double direction_rad = random.Uniform(-std::numbers::pi, std::numbers::pi);
  const Eigen::Vector3d axis(std::cos(direction_rad), std::sin(direction_rad), 0.0);
  const Eigen::Quaterniond R_level_sensor =
      SplitYaw(Eigen::Quaterniond(T_world_sensor.linear())).R_level_sensor;
  const Eigen::Quaterniond disturbed(Eigen::AngleAxisd(tilt_error_rad, axis) * R_level_sensor);
  return SplitYaw(disturbed).R_level_sensor;
}

Pose PerturbedStart(const Pose& T_world_sensor,
                    const Eigen::Quaterniond& R_level_sensor,
                    double translation_m,
                    double yaw_rad,
                    const TrialSeed& seed) {
  HashRandom random = Stream(seed, 2);
  const double dx_m = random.Uniform(-translation_m, translation_m);
  const double dy_m = random.Uniform(-translation_m, translation_m);
  const double dz_m = random.Uniform(-kStartHeightError_m, kStartHeightError_m);
  const double true_yaw_rad = SplitYaw(Eigen::Quaterniond(T_world_sensor.linear())).yaw_rad;
  const double start_yaw_rad = true_yaw_rad + random.Uniform(-yaw_rad, yaw_rad);
  Pose start = Pose::Identity();
  start.linear() = Eigen::AngleAxisd(start_yaw_rad, Eigen::Vector3d::UnitZ()) *
                   R_level_sensor.toRotationMatrix();
  start.translation() = T_world_sensor.translation() + Eigen::Vector3d(dx_m, dy_m, dz_m);
  return start;
}

Eigen::Vector3d PerturbedPosition(const Pose& T_world_sensor,
                                  double radius_m,
                                  double height_m,
                                  const TrialSeed& seed) {
  const double reach_m = radius_m / std::numbers::sqrt2;  // the square in the circle
  HashRandom in_plane = Stream(seed, 2);
  const double dx_m = in_plane.Uniform(-reach_m, reach_m);
  const double dy_m = in_plane.Uniform(-reach_m, reach_m);
  const double dz_m = Stream(seed, 3).Uniform(-height_m, height_m);
  return T_world_sensor.translation() + Eigen::Vector3d(dx_m, dy_m, dz_m);
}

}  // namespace atlas
