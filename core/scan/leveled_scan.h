// A segmented scan turned upright: the gravity-levelled frame around the sensor, in polar order.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "core/scan/range_image.h"

namespace atlas {

// Returns as a structure of arrays; levelled frame, origin at the sensor, metres.
struct LeveledScan {
  std::vector<float> x, y, z;
  std::vector<float> range_m;      // horizontal
  std::vector<float> azimuth_rad;  // [0, 2 pi)
  std::vector<std::uint8_t> is_ground;
  float column_spacing_rad = 0.0F;  // between neighbouring returns of the densest channel

  std::size_t size() const { return x.size(); }
};

// `is_ground`: one entry a return of `image` (Segmenter).
LeveledScan LevelScan(const RangeImage& image,
                      std::vector<std::uint8_t> is_ground,
                      const Eigen::Quaternionf& R_level_sensor);

}  // namespace atlas
