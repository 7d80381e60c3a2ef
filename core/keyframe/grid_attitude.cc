#include "core/keyframe/grid_attitude.h"

#include <cmath>
#include <numbers>

namespace atlas {

Eigen::Quaterniond GridAttitude::R_grid_sensor() const {
  // Grid coordinates of what is fixed turn against the grid.
  return Eigen::Quaterniond(Eigen::AngleAxisd(-yaw_rad, Eigen::Vector3d::UnitZ())) * R_level_sensor;
}

double GridYaw(std::uint64_t sequence) {
  // Multiples of the golden ratio fill the interval evenly, however many there are.
  constexpr double kGolden = std::numbers::phi - 1.0;
  const double turns = static_cast<double>(sequence) * kGolden;
  return (turns - std::floor(turns)) * 0.5 * std::numbers::pi;
}

std::vector<VehiclePlace> Turned(std::span<const VehiclePlace> places, double yaw_rad) {
  const Eigen::Matrix3f R =
      Eigen::AngleAxisd(-yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix().cast<float>();
  std::vector<VehiclePlace> turned(places.begin(), places.end());
  for (VehiclePlace& place : turned) {
    place.sensor_m = R * place.sensor_m;
    place.ahead = R.topLeftCorner<2, 2>() * place.ahead;
    place.normal = R * place.normal;
  }
  return turned;
}

}  // namespace atlas
