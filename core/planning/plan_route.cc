// Snap both ends to the map, search, thin out.
#include "core/planning/plan_route.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/integer_math.h"
#include "core/base/str_cat.h"
#include "core/planning/route_search.h"
#include "core/planning/surface_map.h"

namespace atlas {
namespace {

constexpr double kWorld_m = 1e7;  // as for poses

class Snapper {
 public:
  Snapper(SurfaceMap& map, const MapProfile& profile, const PlanOptions& options)
      : map_(map), profile_(profile), options_(options) {}

  // The drivable node nearest in plan; none where there is a traversable surface, but none that
  // this vehicle may stand on. kNotFound where there is no such surface at all.
  Result<NodeRef> Snap(const char* what, const Eigen::Vector3d& point) {
    for (const double below_m : {options_.snap_below_m, options_.snap_far_below_m}) {
      const Result<Best> best = Search(point, below_m);
      if (!best) {
        return Error(best.error());
      }
      if (best->is_anything_open) {
        return best->ref;
      }
    }
    return Error(
        StatusCode::kNotFound,
        StrCat("plan: no traversable surface within ", options_.snap_radius_m, " m of the ", what,
               " (", point.x(), ", ", point.y(), ", ", point.z(), "), expected one between ",
               std::max(options_.snap_below_m, options_.snap_far_below_m), " m below and ",
               options_.snap_above_m, " m above it"));
  }

 private:
  struct Best {
    double distance_m = std::numeric_limits<double>::infinity();
    NodeRef ref;
    bool is_anything_open = false;
  };

  Result<Best> Search(const Eigen::Vector3d& point, double below_m) {
    const std::int64_t side = profile_.tile_cells;
    const auto cell_of = [&](double m) {
      return static_cast<std::int64_t>(std::floor(m / profile_.cell_size_m()));
    };
    const double reach_m = options_.snap_radius_m;
    Best best;
    for (std::int64_t ty = FloorDiv(cell_of(point.y() - reach_m), side);
         ty <= FloorDiv(cell_of(point.y() + reach_m), side); ++ty) {
      for (std::int64_t tx = FloorDiv(cell_of(point.x() - reach_m), side);
           tx <= FloorDiv(cell_of(point.x() + reach_m), side); ++tx) {
        const TileId id{0, static_cast<std::int32_t>(tx), static_cast<std::int32_t>(ty)};
        if (Status status = SearchTile(id, point, below_m, best); !status.ok()) {
          return Error(std::move(status));
        }
      }
    }
    return best;
  }

  Status SearchTile(const TileId& id, const Eigen::Vector3d& point, double below_m, Best& best) {
    const auto slot = map_.Ready(id);
    if (!slot) {
      return slot.error();
    }
    if (*slot == SurfaceTile::kNotThere) {
      return {};
    }
    const auto used = static_cast<std::uint32_t>(*slot);
    const std::size_t cells = map_.tile(used).cell_begin.size() - 1;
    for (std::size_t cell = 0; cell < cells; ++cell) {
      const double distance_m = DistanceInPlan(id, cell, point);
      if (distance_m > options_.snap_radius_m || distance_m >= best.distance_m) {
        continue;
      }
      const NodeRef ref = Standing(used, cell, point.z(), below_m);
      if (ref.is_none() || !map_.node(ref).Has(SurfaceNode::kOpen)) {
        continue;
      }
      best.is_anything_open = true;
      if (map_.IsDrivable(ref)) {
        best.distance_m = distance_m;
        best.ref = ref;
      }
    }
    return {};
  }

  double DistanceInPlan(const TileId& id, std::size_t cell, const Eigen::Vector3d& point) const {
    const std::int64_t side = profile_.tile_cells;
    const auto index = static_cast<std::int64_t>(cell);
    const auto middle_m = [&](std::int64_t cells) {
      return (static_cast<double>(cells) + 0.5) * profile_.cell_size_m();
    };
    return std::hypot(middle_m(id.x * side + index % side) - point.x(),
                      middle_m(id.y * side + index / side) - point.y());
  }

  // The highest surface of the cell that a point at this height may stand on.
  NodeRef Standing(std::uint32_t slot, std::size_t cell, double z_m, double below_m) {
    const SurfaceTile& tile = map_.tile(slot);
    NodeRef ref;
    for (std::uint32_t i = tile.cell_begin[cell]; i < tile.cell_begin[cell + 1]; ++i) {
      const double above_m = 1e-3 * tile.nodes[i].altitude_mm - z_m;
      if (above_m <= options_.snap_above_m && above_m >= -below_m) {
        ref = {slot, i};
      }
    }
    return ref;
  }

  SurfaceMap& map_;
  const MapProfile& profile_;
  const PlanOptions& options_;
};

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

// Drops points between kept ones, as long as those stay near each other and within one step.
std::vector<Eigen::Vector3d> ThinOut(const std::vector<Eigen::Vector3d>& points,
                                     const PlanOptions& options) {
  std::vector<Eigen::Vector3d> kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool is_end = i == 0 || i + 1 == points.size();
    if (!is_end) {
      const Eigen::Vector3d ahead = points[i + 1] - kept.back();
      if (ahead.norm() <= options.waypoint_spacing_m && std::abs(ahead.z()) <= options.max_step_m) {
        continue;
      }
    }
    kept.push_back(points[i]);
  }
  return kept;
}

Route Describe(const std::vector<NodeRef>& way,
               const RouteSearch& search,
               const PlanOptions& options) {
  Route route;
  route.found = !way.empty();
  route.expansions = search.expansions();
  route.cost = search.cost();
  std::vector<Eigen::Vector3d> points;
  points.reserve(way.size());
  for (const NodeRef& ref : way) {
    points.push_back(search.Position(ref));
  }
  route.waypoints = ThinOut(points, options);
  for (std::size_t i = 1; i < route.waypoints.size(); ++i) {
    route.length_m += (route.waypoints[i] - route.waypoints[i - 1]).norm();
  }
  return route;
}

}  // namespace

Result<Route> PlanRoute(TileSource& tiles, const MapProfile& profile, const PlanRequest& request) {
  if (Status status = CheckRequest(profile, request); !status.ok()) {
    return Error(std::move(status));
  }
  SurfaceMap map(tiles, profile, request.options);
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
  if (!start->is_none() && !goal->is_none()) {
    RouteSearch search(map, profile, request.options);
    const auto way = search.Run(*start, *goal);
    if (!way) {
      return Error(way.error());
    }
    route = Describe(*way, search, request.options);
  }
  route.tiles_loaded = map.tiles_loaded();
  return route;
}

}  // namespace atlas
