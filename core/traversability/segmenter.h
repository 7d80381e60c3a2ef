// Traversable area and obstacles in one scan (paper III-A, algorithm 1): a plane by RANSAC in each
// of many overlapping windows of 3 rings x 10 degrees.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/scan/range_image.h"

namespace atlas {

enum class SegmentMode : std::uint8_t {
  kPaper,  // windows of neighbouring rings; a return is ground when any window says so
  kAtlas,  // windows of a fixed angle; a third of the windows must say so; floors lie below the
           // sensor
};

struct SegmenterOptions {
  SegmentMode mode = SegmentMode::kAtlas;
  // Distance to the plane within which a return belongs to it. Measured: best F1 at 0.08 to 0.10.
  float threshold_m = 0.10F;
  float max_slope_rad = 0.4F;     // paper III-A, check_normal
  float min_inlier_ratio = 0.5F;  // paper algorithm 1
  std::uint32_t min_returns = 9;  // fewer make no plane
  // Share of the windows over a return that must call it ground. Measured: two of the usual six
  // give F1 0.978, three 0.970 (docs/results.md).
  float min_vote_ratio = 0.33F;
};

class Segmenter {
 public:
  explicit Segmenter(const SegmenterOptions& options) : options_(options) {}

  // For each entry of `image` 1 where it is traversable ground, 0 where it is an obstacle.
  // `up_sensor`: unit vector against gravity in the sensor frame, as an IMU knows it.
  std::vector<std::uint8_t> Segment(const RangeImage& image,
                                    const Eigen::Vector3f& up_sensor) const;

 private:
  SegmenterOptions options_;
};

}  // namespace atlas
