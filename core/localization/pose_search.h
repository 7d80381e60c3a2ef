// Where else the vehicle may be: tries headings and places around a pose at once, by how many
// columns of the scan fall on structure of the map (correlative matching on a coarse grid).
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/scan_features.h"
#include "core/localization/window/map_window.h"

namespace atlas {

struct PoseSearchOptions {
  double step_m = 0.5;
  double yaw_step_rad = 0.0175;  // 1 degree: a block at 46 m
  std::size_t max_columns = 64;  // of the scan, evenly chosen ...
  std::size_t min_columns = 15;  // ... fewer say nothing
  std::size_t candidates = 6;    // which differ by this much:
  double apart_m = 1.0;
  double apart_rad = 0.07;
};

// How far around a pose is searched.
struct SearchReach {
  double along_m = 2.0;        // either way along `direction_rad`
  double beside_m = 2.0;       // either way across it
  double yaw_rad = 1.2;        // either way
  double direction_rad = 0.0;  // from the world's x
};

// The map window at arm's length: structure is widened by one block either way.
class CoarseOccupancy {
 public:
  CoarseOccupancy(const MapWindow& map, float block_m);

  // Whether structure stands within a block of `p` (window frame) at its height.
  bool IsOccupied(const Eigen::Vector3f& p) const;

 private:
  float block_m_;
  float segment_height_m_;
  std::int32_t side_;
  std::vector<std::uint64_t> masks_;
};

// Starts for registrations, the best first; none where the scan has too few columns. `origin`: of
// the window frame.
std::vector<Pose> SearchPoses(const CoarseOccupancy& coarse,
                              const Eigen::Vector3d& origin,
                              const ScanFeatures& features,
                              const Pose& T_world_level,
                              const SearchReach& reach,
                              const PoseSearchOptions& options);

}  // namespace atlas
