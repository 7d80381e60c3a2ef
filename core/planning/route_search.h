// A* over (cell, layer). Nodes of neighbouring cells are joined when both are drivable and their
// heights differ by no more than a step; never by the layer's index. So ramps join decks, and a
// bridge is not joined to the road below.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/planning/surface_map.h"

namespace atlas {

class RouteSearch {
 public:
  // All outlive the search.
  RouteSearch(SurfaceMap& map, const MapProfile& profile, const PlanOptions& options);

  // The cheapest way from `start` to `goal`, both included; empty when there is none.
  // kResourceExhausted beyond the limit of expansions or memory; errors of the tile source.
  Result<std::vector<NodeRef>> Run(const NodeRef& start, const NodeRef& goal);

  // The middle of the node's cell, on its surface, world frame.
  Eigen::Vector3d Position(const NodeRef& ref) const;
  std::uint64_t expansions() const { return expansions_; }
  double cost() const { return cost_; }  // of the way found

 private:
  struct OpenNode {
    float estimate = 0.0F;
    NodeRef ref;
  };

  Status Expand(const NodeRef& ref);
  Status Look(const NodeRef& from, std::int32_t dx, std::int32_t dy);
  Status Relax(const NodeRef& from, const NodeRef& to, double flat_m);
  double Heuristic(const Eigen::Vector3d& position) const;
  Status Push(float estimate, const NodeRef& ref);
  NodeRef Pop();
  std::vector<NodeRef> WayTo(const NodeRef& goal) const;

  SurfaceMap& map_;
  const MapProfile& profile_;
  const PlanOptions& options_;
  std::int32_t max_cells_;  // of one move: 1 + the gap that may be crossed
  std::int32_t max_step_mm_;
  Eigen::Vector3d goal_ = Eigen::Vector3d::Zero();
  std::vector<OpenNode> open_;  // a heap
  std::uint64_t expansions_ = 0;
  double cost_ = 0.0;
};

}  // namespace atlas
