// The geometry of a spinning LiDAR: which rays it casts, and how well it measures along them.
#pragma once

#include <cstddef>
#include <numbers>
#include <string_view>
#include <vector>

#include "core/base/status.h"

namespace atlas {

// Sensor frame: x forward, y left, z up. Ring 0 is the lowest; column c looks at azimuth
// 2 pi (c + 0.5) / columns, counter-clockwise from x.
struct LidarSensor {
  std::vector<double> elevations_rad;  // ascending, one a ring
  std::size_t columns = 1800;
  double min_range_m = 0.9;    // VLP-16 manual
  double max_range_m = 100.0;  // VLP-16 manual
  double range_sigma_m = 0.02;

  std::size_t rings() const { return elevations_rad.size(); }
  double azimuth_rad(std::size_t column) const {
    constexpr double kTurn = 2.0 * std::numbers::pi;
    return kTurn * (static_cast<double>(column) + 0.5) / static_cast<double>(columns);
  }
};

LidarSensor Vlp16Sensor();

// vlp16: -15..15 deg, 1800 columns. hdl32: -30.67..10.67 deg. hdl64: KITTI's, 32 rings a third of a
// degree apart from +2 deg down and 32 half a degree apart below. h350: 16 rings of 350 columns.
// kInvalidArgument for another name.
Result<LidarSensor> LidarSensorByName(std::string_view name);

}  // namespace atlas
