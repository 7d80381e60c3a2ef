// A scan thinned out for matching: a few thousand points that say where the vehicle is.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/scan/leveled_scan.h"

namespace atlas {

struct FeatureOptions {
  float max_range_m = 40.0F;
  float column_voxel_m = 0.25F;  // obstacle returns are averaged per voxel ...
  float column_height_m = 0.5F;  // ... of this height
  float ground_voxel_m = 1.0F;   // ground returns per square
};

// Levelled frame, origin at the sensor, metres.
struct ScanFeatures {
  std::vector<Eigen::Vector3f> columns;
  std::vector<Eigen::Vector3f> ground;
};

ScanFeatures ExtractFeatures(const LeveledScan& scan, const FeatureOptions& options);

}  // namespace atlas
