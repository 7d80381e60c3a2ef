// A scan thinned out for matching: a few thousand points that say where the vehicle is.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/scan/leveled_scan.h"

namespace atlas {

struct FeatureOptions {
  float max_range_m = 40.0F;
  float column_voxel_m = 0.25F;     // obstacle returns are averaged per voxel ...
  float column_height_m = 0.5F;     // ... of this height
  float ground_voxel_m = 1.0F;      // ground returns per square
  std::size_t max_returns = 8'192;  // obstacle returns that are kept as they are, evenly chosen
};

// Levelled frame, origin at the sensor, metres.
struct ScanFeatures {
  std::vector<Eigen::Vector3f> columns;
  std::vector<Eigen::Vector3f> ground;
  // From obstacles; every fourth first, then every second of the others: whoever takes as many as
  // he likes from the front has some of everywhere.
  std::vector<Eigen::Vector3f> returns;
};

ScanFeatures ExtractFeatures(const LeveledScan& scan, const FeatureOptions& options);

}  // namespace atlas
