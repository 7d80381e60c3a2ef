// A scan organised by channel and azimuth: what segmentation and columns work on.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scan/point_cloud.h"
#include "core/scan/sensor_layout.h"

namespace atlas {

// Returns sorted by row (lowest channel first), within a row by azimuth sector. Structure of
// arrays, padded by kPadding entries far away so that loops may run in whole vectors.
struct RangeImage {
  static constexpr int kSectors = 72;  // 5 degrees: half the paper's window of about 10 degrees
  static constexpr std::size_t kPadding = 16;

  int rows = 0;
  std::vector<float> x, y, z;               // sensor frame, metres
  std::vector<std::uint32_t> source;        // index into the scan
  std::vector<std::uint32_t> sector_begin;  // rows * kSectors + 1 offsets

  std::size_t size() const { return source.size(); }
  std::uint32_t Begin(int row, int sector) const {
    return sector_begin[static_cast<std::size_t>(row * kSectors + sector)];
  }
  std::uint32_t End(int row, int sector) const {
    return sector_begin[static_cast<std::size_t>(row * kSectors + sector + 1)];
  }
};

// `ring_step` keeps every ring_step-th channel from the lowest: 4 makes 16 rings of 64.
RangeImage MakeRangeImage(const PointCloud& cloud, const SensorLayout& layout, int ring_step);

// For N rings out of `channels`: max(1, round(channels / N)).
int RingStep(int channels, int rings);

}  // namespace atlas
