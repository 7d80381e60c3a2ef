// A straight line over the map, as a vehicle's middle would follow it: the surface below it, cell
// by cell.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/planning/surface/surface_map.h"

namespace atlas {

struct LinePoint {
  NodeRef node;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world frame, on the surface
};

struct SurfaceLine {
  std::vector<LinePoint> points;  // one a cell, in the middle of what the line has of it
  double cost = 0.0;              // of all but the first, as a search counts it
};

// The middle of a node's cell, on its surface, world frame.
Eigen::Vector3d PositionOf(const SurfaceTiles& tiles, const NodeRef& ref);

// From the middle of one cell to that of another. None where a cell on the way is not drivable, is
// higher or lower by more than a step, or where a hole is longer than may be crossed; none either
// when the line ends on another layer than `to`, or costs more than `max_cost`. Errors as of
// SurfaceTiles::Load.
Result<std::optional<SurfaceLine>> FollowLine(SurfaceMap& map,
                                              const NodeRef& from,
                                              const NodeRef& to,
                                              double max_cost);

}  // namespace atlas
