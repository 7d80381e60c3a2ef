// The last scans of a vehicle, each where it was taken: what the next one is matched with where the
// map has nothing.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/scan_features.h"

namespace atlas {

class RecentScans {
 public:
  explicit RecentScans(std::size_t most) : most_(most) {}

  void Clear() { count_ = 0; }
  bool is_empty() const { return count_ == 0; }
  // In the place of the oldest, if there are `most` already.
  void Add(const ScanFeatures& features, const Pose& T_world_level);

  // All that stands there, and their ground; from `origin`, axes of the world, metres.
  std::vector<Eigen::Vector3f> Columns(const Eigen::Vector3d& origin) const;
  std::vector<Eigen::Vector3f> Ground(const Eigen::Vector3d& origin) const;

 private:
  struct Scan {
    Pose T_world_level = Pose::Identity();
    std::vector<Eigen::Vector3f> columns;
    std::vector<Eigen::Vector3f> ground;
  };

  std::size_t most_;
  std::vector<Scan> scans_;  // `count_` of them count; the others are kept for their memory
  std::size_t count_ = 0;
  std::size_t next_ = 0;
};

}  // namespace atlas
