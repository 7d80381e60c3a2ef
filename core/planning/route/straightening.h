// From a way on eight directions to straight lines at any angle.
#pragma once

#include <vector>

#include "core/base/status.h"
#include "core/planning/plan_options.h"
#include "core/planning/route/surface_line.h"
#include "core/planning/surface/surface_map.h"

namespace atlas {

struct StraightWay {
  std::vector<LinePoint> points;     // one a cell
  std::vector<std::size_t> corners;  // where its lines meet, first and last point included
  double searched_cost = 0.0;        // of the way as it was searched
  double cost = 0.0;                 // of the lines: never more
};

// Replaces pieces of the way, nodes of neighbouring cells or beyond a hole, by lines that keep
// every constraint (FollowLine) and cost no more than what they replace. Errors as of
// SurfaceTiles::Load.
Result<StraightWay> Straighten(SurfaceMap& map, const std::vector<NodeRef>& way);

}  // namespace atlas
