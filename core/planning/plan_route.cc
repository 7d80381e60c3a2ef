// Snap both ends to the map, search, straighten, thin out.
#include "core/planning/plan_route.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "core/base/str_cat.h"
#include "core/planning/plan_budget.h"
#include "core/planning/route/snapper.h"
#include "core/planning/route/straightening.h"
#include "core/planning/search/route_search.h"
#include "core/planning/surface/surface_map.h"

namespace atlas {
namespace {

constexpr double kWorld_m = 1e7;  // as for poses

Status CheckPoint(const char* what, const Eigen::Vector3d& point) {
  if (point.allFinite() && point.cwiseAbs().maxCoeff() <= kWorld_m) {
    return {};
  }
  return Status(StatusCode::kInvalidArgument,
                StrCat("plan: ", what, " (", point.x(), ", ", point.y(), ", ", point.z(),
                       "), expected finite metres within +-10000 km"));
}

Status CheckRequest(const MapProfile& profile, const PlanRequest& request) {
  ATLAS_RETURN_IF_ERROR(request.options.Validate(profile));
  ATLAS_RETURN_IF_ERROR(CheckPoint("start", request.from));
  return CheckPoint("goal", request.to);
}

std::optional<RouteEnd> EndAt(const SurfaceTiles& tiles,
                              const NodeRef& ref,
                              const Eigen::Vector3d& asked) {
  if (ref.is_none()) {
    return std::nullopt;
  }
  const SurfaceTile& tile = tiles.tile(ref.slot);
  const SurfaceNode& node = tiles.node(ref);
  RouteEnd end;
  end.asked = asked;
  end.at = {(static_cast<double>(tiles.CellX(ref)) + 0.5) * tiles.cell_m(),
            (static_cast<double>(tiles.CellY(ref)) + 0.5) * tiles.cell_m(),
            1e-3 * node.altitude_mm};
  end.layer = ref.node - tile.cell_begin[node.cell];
  end.layers = tile.Nodes(node.cell).size();
  return end;
}

// Drops points between kept ones, as long as those stay near each other and within one step. The
// line's corners stay.
std::vector<LinePoint> ThinOut(const StraightWay& way, const PlanOptions& options) {
  std::vector<LinePoint> kept;
  auto corner = way.corners.begin();
  for (std::size_t i = 0; i < way.points.size(); ++i) {
    if (corner != way.corners.end() && *corner == i) {
      ++corner;
    } else {
      const Eigen::Vector3d ahead = way.points[i + 1].position - kept.back().position;
      if (ahead.norm() <= options.waypoint_spacing_m && std::abs(ahead.z()) <= options.max_step_m) {
        continue;
      }
    }
    kept.push_back(way.points[i]);
  }
  return kept;
}

void Describe(const StraightWay& way,
              const SurfaceMap& map,
              const PlanOptions& options,
              Route& route) {
  route.found = !way.points.empty();
  route.cost = way.cost;
  route.searched_cost = way.searched_cost;
  for (const LinePoint& point : ThinOut(way, options)) {
    if (!route.waypoints.empty()) {
      route.length_m += (point.position - route.waypoints.back()).norm();
    }
    route.waypoints.push_back(point.position);
    route.clearance_m.push_back(map.ClearanceMetres(point.node));
    const double slope = map.Slope(point.node).value_or(0.0);  // of a drivable node: there is one
    route.slope_deg.push_back(std::atan(slope) * 180.0 / std::numbers::pi);
  }
}

}  // namespace

Result<Route> PlanRoute(TileSource& tiles, const MapProfile& profile, const PlanRequest& request) {
  if (Status status = CheckRequest(profile, request); !status.ok()) {
    return Error(std::move(status));
  }
  PlanBudget budget(request.options, request.now_s, request.memory);
  SurfaceMap map(tiles, profile, request.options, budget);
  Snapper snapper(map, profile, request.options);
  const auto start = snapper.Snap("start", request.from);
  if (!start) {
    return Error(start.error());
  }
  const auto goal = snapper.Snap("goal", request.to);
  if (!goal) {
    return Error(goal.error());
  }
  Route route;
  route.start = EndAt(map.tiles(), *start, request.from);
  route.goal = EndAt(map.tiles(), *goal, request.to);
  if (!start->is_none() && !goal->is_none()) {
    RouteSearch search(tiles, profile, request.options, budget, map);
    const auto way = search.Run(*start, *goal);
    if (!way) {
      return Error(way.error());
    }
    const auto straight = Straighten(map, *way);
    if (!straight) {
      return Error(straight.error());
    }
    Describe(*straight, map, request.options, route);
  }
  route.expansions = budget.expansions();
  route.tiles_loaded = map.tiles().size();
  route.max_memory_bytes = budget.max_memory_seen_bytes();
  return route;
}

}  // namespace atlas
