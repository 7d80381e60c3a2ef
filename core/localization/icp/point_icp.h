// Iterative closest points, point to point: pairs each point with the nearest one of a map, turns
// and moves the cloud so that the squared distances of the pairs are least, and again.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/icp/point_index.h"

namespace atlas {

struct PointIcpOptions {
  float reach_m = 1.0F;  // pairs farther apart are none
  int max_iterations = 50;
  // A step that moves and turns less ends it.
  double converged_m = 1e-3;
  double converged_rad = 1e-4;
  std::size_t min_pairs = 30;  // fewer say nothing
};

struct PointIcpResult {
  Pose T_map_scan = Pose::Identity();
  int iterations = 0;
  std::size_t pairs = 0;  // of the last step
  double rmse_m = 0.0;    // of their distances
  bool is_converged = false;
};

// `scan` in its own frame, `map` in the frame of `T_map_scan`; metres. Where fewer than
// `min_pairs` are paired, the pose stays as it is.
PointIcpResult AlignPoints(const PointIndex& map,
                           const std::vector<Eigen::Vector3f>& scan,
                           const Pose& T_map_scan,
                           const PointIcpOptions& options);

}  // namespace atlas
