// Where the returns of a scan lie, seen from the sensor.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scan/ego_box.h"
#include "core/scan/point_cloud.h"

namespace atlas {

// Returns farther apart are no neighbours on a ring.
inline constexpr float kNeighbours_rad = 0.1F;

struct ReturnDirections {
  std::vector<float> azimuth_rad;    // the way the sensor turns, [0, 2 pi)
  std::vector<float> slope;          // tangent of the elevation
  std::vector<std::uint32_t> index;  // in the scan, growing

  std::uint32_t size() const { return static_cast<std::uint32_t>(slope.size()); }
};

// Of the returns from the world: what hits the vehicle itself points anywhere.
ReturnDirections MeasureDirections(const PointCloud& cloud, const EgoBox& ego);

}  // namespace atlas
