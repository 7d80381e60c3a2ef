// Where else the vehicle may be: tries headings and places around a pose at once, by how many
// columns of the scan fall on structure of the map (correlative matching on a coarse grid).
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/window/coarse_occupancy.h"

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

// Starts for registrations, the best first; none where the scan has too few columns. `origin`: of
// the window frame.
std::vector<Pose> SearchPoses(const CoarseOccupancy& coarse,
                              const Eigen::Vector3d& origin,
                              const ScanFeatures& features,
                              const Pose& T_world_level,
                              const SearchReach& reach,
                              const PoseSearchOptions& options);

}  // namespace atlas
