// Traversable area and obstacles in one scan (paper III-A, algorithm 1): a plane by RANSAC in each
// of many overlapping windows of 3 rings x 10 degrees.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/scan/range_image.h"

namespace atlas {

enum class SegmentMode : std::uint8_t {
  kPaper,  // windows of neighbouring rings, triples from anywhere in them; a return is ground when
           // any window says so
  kAtlas,  // windows of a fixed angle, triples across their rings; half of the windows over a
           // return must say so; floors lie below the sensor
};

struct SegmenterOptions {
  SegmentMode mode = SegmentMode::kAtlas;
  // Distance to the plane within which a return belongs to it. Measured on labelled real scans with
  // the vote below: F1 0.970 at 0.10, 0.973 at 0.12 (docs/results.md).
  float threshold_m = 0.12F;
  float max_slope_rad = 0.4F;     // paper III-A, check_normal
  float min_inlier_ratio = 0.5F;  // paper algorithm 1
  std::uint32_t min_returns = 9;  // fewer make no plane (kAtlas)
  // Share of the windows over a return that must call it ground. A third of them scores higher on
  // streets (F1 0.978) but reads the sloped ceilings of a garage as floors.
  float min_vote_ratio = 0.5F;
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
