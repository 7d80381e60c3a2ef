// How a keyframe's grid stands: level, and turned against the vehicle, each grid by another angle
// (decision 0601).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "core/geometry/vehicle_body.h"

namespace atlas {

struct GridAttitude {
  // The attitude without yaw (SplitYaw), as an IMU knows it, never a fit to the ground.
  Eigen::Quaterniond R_level_sensor = Eigen::Quaterniond::Identity();
  double yaw_rad = 0.0;  // of the grid's frame from the levelled one

  // From the sensor into the grid's frame.
  Eigen::Quaterniond R_grid_sensor() const;
};

// The angle of a drive's `sequence`-th keyframe, [0, pi / 2): the cells of many keyframes then
// stand evenly in all directions. Grids along a straight road would all lie on the road's lattice,
// and what is drawn in them be off together, by up to half a cell to the side.
double GridYaw(std::uint64_t sequence);

// Places of the levelled frame in a grid's frame that is turned by `yaw_rad`.
std::vector<VehiclePlace> Turned(std::span<const VehiclePlace> places, double yaw_rad);

}  // namespace atlas
