// A scan thinned out for matching: a few thousand points that say where the vehicle is.
#pragma once

#include <cstddef>
#include <cstdint>
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

// Half of its columns and ground and a quarter of its returns: they find a place to some
// centimetres. `thinned` keeps its memory.
void Thin(const ScanFeatures& scan, ScanFeatures& thinned);

// Averages points that share a voxel; voxels in a fixed order.
class VoxelAverager {
 public:
  VoxelAverager(float side_m, float height_m);

  void Clear() { sums_.clear(); }
  void Add(const Eigen::Vector3f& p);
  // Of what was added since Clear().
  void Means(std::vector<Eigen::Vector3f>& means);

 private:
  struct Sum {
    std::uint64_t voxel;  // and, below it, the order in which it was begun
    Eigen::Vector3f sum;
    float count;
  };

  std::uint64_t Voxel(const Eigen::Vector3f& p) const;

  Eigen::Vector3f voxels_per_m_;
  std::vector<Sum> sums_;
};

// Keeps its memory from scan to scan.
class FeatureExtractor {
 public:
  explicit FeatureExtractor(const FeatureOptions& options);

  // Valid until the next scan.
  const ScanFeatures& Extract(const LeveledScan& scan);
  // The same of points that are no scan: Begin, each of them, Finish.
  void Begin();
  void AddObstacle(const Eigen::Vector3f& p);
  void AddGround(const Eigen::Vector3f& p) { ground_.Add(p); }
  const ScanFeatures& Finish();

 private:
  FeatureOptions options_;
  VoxelAverager columns_;
  VoxelAverager ground_;
  std::vector<Eigen::Vector3f> obstacles_;
  ScanFeatures features_;
};

// Of one scan.
ScanFeatures ExtractFeatures(const LeveledScan& scan, const FeatureOptions& options);

}  // namespace atlas
