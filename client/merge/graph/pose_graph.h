// All submaps' poses at once, so that what is known of them fits best: least squares on SE(3), with
// a robust loss where a measurement may be wrong (Ceres).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/pose.h"

namespace atlas {

using PoseInformation6 = Eigen::Matrix<double, 6, 6>;

struct GraphNode {
  Pose T_world_submap = Pose::Identity();  // where it begins
  bool is_fixed = false;
};

// Submap `to` lies at T_from_to in submap `from`; `information` of (translation, rotation vector)
// in 1/m^2 and 1/rad^2, axes of `from`, about the origin of `to`: symmetric, positive semidefinite.
struct GraphEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  Pose T_from_to = Pose::Identity();
  PoseInformation6 information = PoseInformation6::Identity();
  bool may_be_wrong = false;
};

// A point of a submap is known to be somewhere, as a GNSS says; metres. It may be wrong, as an edge
// may.
struct GraphPrior {
  std::size_t node = 0;
  Eigen::Vector3d p_submap = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Ones();  // along the world's axes, above 0
  // Of so many whose errors are one error each counts as this part of one; above 0. How far it is
  // off, and so whether it may be wrong, goes by its sigmas all the same.
  double share = 1.0;
};

struct PoseGraph {
  std::vector<GraphNode> nodes;
  std::vector<GraphEdge> edges;
  std::vector<GraphPrior> priors;
};

struct PoseGraphOptions {
  // An edge that may be wrong, or a prior, pulls less the more sigmas it is off: Cauchy, from here
  // on.
  double robust_sigmas = 3.0;
  // A submap's grids were levelled by an IMU: how far its z axis may be from the vertical, about x
  // and about y.
  double tilt_sigma_rad = 0.006;
  int max_iterations = 100;
  int threads = 2;
};

struct PoseGraphResult {
  std::vector<Pose> T_world_submap;     // of each node
  std::vector<double> edge_off_sigmas;  // of each edge, what is left: the root of r' I r
  int iterations = 0;
  double cost_before = 0.0;  // half the sum of all squares, robust ones as they count
  double cost_after = 0.0;
};

// A part of the graph in which nothing is fixed and no prior says where it is stays at its first
// node. The result does not depend on `threads` beyond rounding.
// kInvalidArgument: an edge or prior of a node that is not there, an edge from a node to itself,
// information or sigmas that are none. kInternal where no solution is found.
Result<PoseGraphResult> Optimize(const PoseGraph& graph, const PoseGraphOptions& options);

}  // namespace atlas
