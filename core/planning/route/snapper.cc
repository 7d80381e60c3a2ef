// The nearest drivable cell, on the highest surface that the point may stand on.
#include "core/planning/route/snapper.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/integer_math.h"
#include "core/base/str_cat.h"

namespace atlas {

Result<NodeRef> Snapper::Snap(const char* what, const Eigen::Vector3d& point) {
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

Result<Snapper::Best> Snapper::Search(const Eigen::Vector3d& point, double below_m) {
  const std::int64_t side = profile_.tile_cells;
  const auto tile_of = [&](double m) {
    return FloorDiv(static_cast<std::int64_t>(std::floor(m / profile_.cell_size_m())), side);
  };
  const double reach_m = options_.snap_radius_m;
  Best best;
  for (std::int64_t y = tile_of(point.y() - reach_m); y <= tile_of(point.y() + reach_m); ++y) {
    for (std::int64_t x = tile_of(point.x() - reach_m); x <= tile_of(point.x() + reach_m); ++x) {
      const TileId id{0, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)};
      if (Status status = SearchTile(id, point, below_m, best); !status.ok()) {
        return Error(std::move(status));
      }
    }
  }
  return best;
}

Status Snapper::SearchTile(const TileId& id,
                           const Eigen::Vector3d& point,
                           double below_m,
                           Best& best) {
  const auto slot = map_.tiles().Load(id);
  if (!slot) {
    return slot.error();
  }
  if (*slot == SurfaceTile::kNotThere) {
    return {};
  }
  const auto used = static_cast<std::uint32_t>(*slot);
  const SurfaceTile& tile = map_.tiles().tile(used);
  const auto cells = static_cast<std::uint32_t>(tile.cell_begin.size() - 1);
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    const double distance_m = DistanceInPlan(tile, cell, point);
    if (distance_m > options_.snap_radius_m || distance_m >= best.distance_m) {
      continue;
    }
    const NodeRef ref = Standing(used, cell, point.z(), below_m);
    if (ref.is_none() || !map_.tiles().node(ref).Has(SurfaceNode::kOpen)) {
      continue;
    }
    best.is_anything_open = true;
    ATLAS_RETURN_IF_ERROR(map_.Analyse(ref));
    if (map_.tiles().node(ref).Has(SurfaceNode::kDrivable)) {
      best.distance_m = distance_m;
      best.ref = ref;
    }
  }
  return {};
}

double Snapper::DistanceInPlan(const SurfaceTile& tile,
                               std::uint32_t cell,
                               const Eigen::Vector3d& point) const {
  const std::uint32_t side = profile_.tile_cells;
  const auto middle_m = [&](std::int64_t cells) {
    return (static_cast<double>(cells) + 0.5) * profile_.cell_size_m();
  };
  return std::hypot(middle_m(tile.origin_x + cell % side) - point.x(),
                    middle_m(tile.origin_y + cell / side) - point.y());
}

// The highest surface of the cell that a point at this height may stand on.
NodeRef Snapper::Standing(std::uint32_t slot,
                          std::uint32_t cell,
                          double z_m,
                          double below_m) const {
  const SurfaceTile& tile = map_.tiles().tile(slot);
  NodeRef ref;
  for (std::uint32_t i = tile.cell_begin[cell]; i < tile.cell_begin[cell + 1]; ++i) {
    const double above_m = 1e-3 * tile.nodes[i].altitude_mm - z_m;
    if (above_m <= options_.snap_above_m && above_m >= -below_m) {
      ref = {slot, i};
    }
  }
  return ref;
}

}  // namespace atlas
