// Cuts a scan into its rings by the order of the returns and their elevation, never by intensity.
//
// Drives store ring after ring; within a ring the azimuth runs once around. A ring ends where the
// azimuth passes the place where rings begin, where it steps back, or where it leaps ahead to
// another elevation (rings that see mostly sky hold a few returns only).
#pragma once

#include <cstdint>
#include <vector>

#include "core/scan/ego_box.h"
#include "core/scan/point_cloud.h"

namespace atlas {

struct RingRun {
  std::uint32_t begin = 0;  // [begin, end) of RingSplit's arrays
  std::uint32_t end = 0;
  float elevation_rad = 0.0F;  // median
  float spread = 0.0F;         // of the elevation's tangent, 5th to 95th percentile

  std::uint32_t size() const { return end - begin; }
};

struct RingSplit {
  std::vector<RingRun> runs;         // in file order
  std::vector<std::uint32_t> index;  // into the scan; without the vehicle itself
  std::vector<float> azimuth_rad;    // of each, [0, 2 pi), growing along a run
  bool is_bottom_first = true;       // the order in which the file has the rings
};

RingSplit SplitRings(const PointCloud& cloud, const EgoBox& ego);

}  // namespace atlas
