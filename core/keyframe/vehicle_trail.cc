#include "core/keyframe/vehicle_trail.h"

#include <cstddef>

namespace atlas {
namespace {

constexpr double kLength_m = 5.0;
constexpr double kSpacing_m = 1.0;

// World from the levelled frame: the sensor's place, upright, its yaw.
Pose Leveled(const Pose& T_world_sensor) {
  const Eigen::Quaterniond R_world_sensor(T_world_sensor.linear());
  Pose T_world_level = T_world_sensor;
  T_world_level.linear() =
      (R_world_sensor * SplitYaw(R_world_sensor).R_level_sensor.conjugate()).toRotationMatrix();
  return T_world_level;
}

VehiclePlace PlaceAt(const Pose& T_level_sensor, const SensorMount& mount) {
  VehiclePlace place;
  place.sensor_m = T_level_sensor.translation().cast<float>();
  place.ahead = Leveled(T_level_sensor).linear().col(0).head<2>().cast<float>();
  place.normal = (T_level_sensor.linear() * mount.up).cast<float>();
  return place;
}

Pose Between(const Pose& a, const Pose& b, double share) {
  Pose pose = Pose::Identity();
  pose.translation() = a.translation() + share * (b.translation() - a.translation());
  pose.linear() = Eigen::Quaterniond(a.linear())
                      .slerp(share, Eigen::Quaterniond(b.linear()))
                      .toRotationMatrix();
  return pose;
}

}  // namespace

std::vector<VehiclePlace> TrailBefore(std::span<const Pose> T_world_sensor,
                                      const SensorMount& mount) {
  std::vector<VehiclePlace> places;
  if (T_world_sensor.empty()) {
    return places;
  }
  const Pose T_level_world = Leveled(T_world_sensor.back()).inverse();
  double driven_m = 0.0;
  double next_m = kSpacing_m;
  for (std::size_t i = T_world_sensor.size() - 1; i > 0 && next_m <= kLength_m; --i) {
    const Pose& later = T_world_sensor[i];
    const Pose& earlier = T_world_sensor[i - 1];
    const double step_m = (later.translation() - earlier.translation()).norm();
    if (step_m > kLength_m) {
      break;
    }
    for (; next_m <= kLength_m && next_m <= driven_m + step_m; next_m += kSpacing_m) {
      const Pose pose = Between(later, earlier, (next_m - driven_m) / step_m);
      places.push_back(PlaceAt(T_level_world * pose, mount));
    }
    driven_m += step_m;
  }
  return places;
}

}  // namespace atlas
