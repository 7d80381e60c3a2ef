// Obstacles close the cells that lie all within the vehicle's half width of them, wherever in their
// own cell they stand.
#include "core/planning/coarse/coarse_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <utility>

#include "core/base/integer_math.h"

namespace atlas {
namespace {

// Merged layers lie this far from those that they were made of, beside what the ground climbs.
constexpr double kMerged_m = 0.5;
// An obstacle this near in height stands on the same surface.
constexpr std::int32_t kSameObstacle_mm = 300;

}  // namespace

CoarseMap::CoarseMap(TileSource& source,
                     const MapProfile& profile,
                     const PlanOptions& options,
                     PlanBudget& budget,
                     std::uint8_t level)
    : tiles_(source, profile, options, budget, level), options_(options) {
  const double cell_m = tiles_.cell_m();
  max_cells_ = static_cast<std::int32_t>(
      std::ceil((options.max_gap_m + profile.cell_size_m()) / cell_m - 1e-9));
  const double climb_m =
      std::tan(options.max_slope_deg * std::numbers::pi / 180.0) * std::numbers::sqrt2 * cell_m;
  const double step_m = std::min(options.max_step_m + climb_m + kMerged_m, 1e-3 * kSameSurface_mm);
  max_step_mm_ = static_cast<std::int32_t>(std::lround(step_m * 1e3));
  FillCosts();
  FillOffsets(profile);
}

void CoarseMap::FillCosts() {
  for (std::size_t i = 0; i < costs_.size(); ++i) {
    const double crowding = 1.0 - static_cast<double>(i) / kFarCost;
    costs_[i] = static_cast<float>(1.0 + options_.comfort_weight * crowding);
  }
}

std::uint8_t CoarseMap::CostAt(double clearance_m) const {
  const double spare_m = clearance_m - options_.inflation_m();
  const double ease =
      options_.comfort_m > 0.0 ? std::clamp(spare_m / options_.comfort_m, 0.0, 1.0) : 1.0;
  return static_cast<std::uint8_t>(std::ceil(kFarCost * ease));
}

void CoarseMap::FillOffsets(const MapProfile& profile) {
  const double reach_m = options_.clearance_reach_m();
  const auto farthest_m = [&](std::int32_t cells) {
    return (std::abs(cells) + 1) * tiles_.cell_m() - profile.cell_size_m();
  };
  const auto cells = static_cast<std::int32_t>(reach_m / tiles_.cell_m()) + 1;
  for (std::int32_t dy = -cells; dy <= cells; ++dy) {
    for (std::int32_t dx = -cells; dx <= cells; ++dx) {
      const double distance_m = std::hypot(farthest_m(dx), farthest_m(dy));
      if (distance_m < reach_m) {
        offsets_.push_back(
            {dx, dy, distance_m, distance_m <= options_.inflation_m(), CostAt(distance_m)});
      }
    }
  }
  std::stable_sort(offsets_.begin(), offsets_.end(),
                   [](const Offset& a, const Offset& b) { return a.farthest_m < b.farthest_m; });
}

bool CoarseMap::IsObstacle(const SurfaceTile& home,
                           const SurfaceNode& node,
                           const Offset& offset) const {
  const CellNodes cell = tiles_.Cell(home, node.cell % tiles_.side() + offset.dx,
                                     node.cell / tiles_.side() + offset.dy);
  for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
    const SurfaceNode& other = tiles_.tile(cell.slot).nodes[i];
    if (other.Has(SurfaceNode::kObstacle) &&
        std::abs(std::int64_t{other.altitude_mm} - node.altitude_mm) <= kSameObstacle_mm) {
      return true;
    }
  }
  return false;
}

Status CoarseMap::Analyse(const NodeRef& ref) {
  ATLAS_RETURN_IF_ERROR(tiles_.Join(ref));
  SurfaceNode& node = tiles_.node(ref);
  if (node.Has(SurfaceNode::kAnalysed)) {
    return {};
  }
  node.flags |= SurfaceNode::kAnalysed;
  Judge(tiles_.tile(ref.slot), node);
  if (finest_ != nullptr && node.Has(SurfaceNode::kDrivable)) {
    const auto farthest_m = FarthestBelow(ref);
    if (!farthest_m) {
      return farthest_m.error();
    }
    if (*farthest_m) {
      node.clearance = std::min(node.clearance, CostAt(**farthest_m));
    } else {
      node.flags &= static_cast<std::uint8_t>(~SurfaceNode::kDrivable);
    }
  }
  return {};
}

// From the middle of the cell on, where it is most likely.
Result<std::optional<double>> CoarseMap::FarthestBelow(const NodeRef& ref) {
  SurfaceTiles& finest = finest_->tiles();
  const int shift = tiles_.level();
  const TileId& id = tiles_.tile(ref.slot).id;
  const SurfaceNode& node = tiles_.node(ref);
  const std::int32_t side = tiles_.side();
  const std::int32_t cells = 1 << shift;
  const std::int32_t x = (node.cell % side) << shift;
  const std::int32_t y = (node.cell / side) << shift;
  const auto slot = finest.Load({0, (id.x << shift) + x / side, (id.y << shift) + y / side});
  if (!slot) {
    return Error(slot.error());
  }
  if (*slot == SurfaceTile::kNotThere) {
    return std::nullopt;
  }
  const auto home = static_cast<std::uint32_t>(*slot);
  const std::int32_t half = cells / 2;
  for (std::int32_t i = 0; i < cells * cells; ++i) {
    const std::int32_t dx = (i + half) % cells;
    const std::int32_t dy = (i / cells + half) % cells;
    const auto cell = static_cast<std::uint32_t>((y % side + dy) * side + x % side + dx);
    const SurfaceTile& tile = finest.tile(home);
    for (std::uint32_t n = tile.cell_begin[cell]; n < tile.cell_begin[cell + 1]; ++n) {
      if (std::abs(std::int64_t{tile.nodes[n].altitude_mm} - node.altitude_mm) >= kSameSurface_mm) {
        continue;
      }
      if (Status status = finest_->Analyse({home, n}); !status.ok()) {
        return Error(std::move(status));
      }
      if (tile.nodes[n].Has(SurfaceNode::kDrivable)) {
        const auto across = [cells](std::int32_t at) {
          return std::max(at, cells - 1 - at);
        };
        return finest_->ClearanceMetres({home, n}) +
               finest.cell_m() * std::hypot(across(dx), across(dy));
      }
    }
  }
  return std::nullopt;
}

void CoarseMap::Judge(const SurfaceTile& home, SurfaceNode& node) const {
  node.clearance = kFarCost;
  if (!node.Has(SurfaceNode::kOpen)) {
    return;
  }
  for (const Offset& offset : offsets_) {
    if (IsObstacle(home, node, offset)) {
      node.clearance = offset.cost;
      if (offset.closes) {
        return;
      }
      break;
    }
  }
  node.flags |= SurfaceNode::kDrivable;
}

Result<NodeRef> CoarseMap::Above(const SurfaceTiles& finer, const NodeRef& ref) {
  const int shift = tiles_.level() - finer.level();
  const std::int64_t side = tiles_.side();
  const std::int64_t x = finer.CellX(ref) >> shift;
  const std::int64_t y = finer.CellY(ref) >> shift;
  const TileId id{tiles_.level(), static_cast<std::int32_t>(FloorDiv(x, side)),
                  static_cast<std::int32_t>(FloorDiv(y, side))};
  const auto slot = tiles_.Load(id);
  if (!slot) {
    return Error(slot.error());
  }
  NodeRef best;
  if (*slot == SurfaceTile::kNotThere) {
    return best;
  }
  const auto home = static_cast<std::uint32_t>(*slot);
  const auto cell_x = static_cast<std::int32_t>(x - id.x * side);
  const auto cell_y = static_cast<std::int32_t>(y - id.y * side);
  if (Status status = tiles_.Join(home, cell_x, cell_y); !status.ok()) {
    return Error(std::move(status));
  }
  std::int32_t best_squared = std::numeric_limits<std::int32_t>::max();
  for (std::int32_t dy = -1; dy <= 1; ++dy) {
    for (std::int32_t dx = -1; dx <= 1; ++dx) {
      const CellNodes cell = tiles_.Cell(tiles_.tile(home), cell_x + dx, cell_y + dy);
      const NodeRef node = tiles_.Nearest(cell, finer.node(ref).altitude_mm, kSameSurface_mm);
      if (node.is_none() || dx * dx + dy * dy >= best_squared) {
        continue;
      }
      if (Status status = Analyse(node); !status.ok()) {
        return Error(std::move(status));
      }
      if (tiles_.node(node).Has(SurfaceNode::kDrivable)) {
        best = node;
        best_squared = dx * dx + dy * dy;
      }
    }
  }
  return best;
}

}  // namespace atlas
