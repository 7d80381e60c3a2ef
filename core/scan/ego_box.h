// The vehicle's own body: returns from it say nothing about the world.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace atlas {

// A box around the sensor, sensor frame, any height. Default: a car with its sensor amidships; the
// KITTI car's own returns, mirrors included, lie within it.
struct EgoBox {
  float front_m = 2.7F;
  float rear_m = 2.2F;
  float half_width_m = 1.6F;

  bool Contains(const Eigen::Vector3f& p_sensor) const {
    return p_sensor.x() < front_m && p_sensor.x() > -rear_m &&
           std::abs(p_sensor.y()) < half_width_m;
  }
};

}  // namespace atlas
