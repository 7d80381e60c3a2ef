// Loading, inflation and the slope of the fitted plane.
#include "core/planning/surface_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "core/base/str_cat.h"
#include "core/planning/plane_fit.h"

namespace atlas {
namespace {

// Surfaces differ in height by no more than this per metre across, be it on the steepest ramp.
constexpr double kSameSurfaceSlope = 0.7;
// An obstacle's altitude is that of the ground near it, known to about this much.
constexpr double kObstacleHeightSlack_m = 0.3;
constexpr double kClearanceSteps = 250.0;
constexpr std::int64_t kHighest_mm = 100'000;
// Slope is sampled no denser than this: closer cells share their noise.
constexpr double kSlopeSampleStep_m = 0.2;

std::int32_t Millimetres(double m) {
  return static_cast<std::int32_t>(std::lround(m * 1e3));
}

}  // namespace

SurfaceMap::SurfaceMap(TileSource& source, const MapProfile& profile, const PlanOptions& options)
    : source_(source),
      profile_(profile),
      options_(options),
      side_(profile.tile_cells),
      clearance_offsets_(ClearanceOffsets()),
      slope_offsets_(SlopeOffsets()) {}

std::vector<SurfaceMap::Offset> SurfaceMap::ClearanceOffsets() const {
  const double reach_m = options_.clearance_reach_m();
  const double cell_m = profile_.cell_size_m();
  const auto reach = static_cast<std::int32_t>(reach_m / cell_m);
  std::vector<Offset> offsets;
  for (std::int32_t dy = -reach; dy <= reach; ++dy) {
    for (std::int32_t dx = -reach; dx <= reach; ++dx) {
      const double distance_m = std::hypot(dx, dy) * cell_m;
      if (distance_m <= reach_m) {
        const double steps = reach_m > 0.0 ? kClearanceSteps * distance_m / reach_m : 0.0;
        offsets.push_back({dx, dy,
                           Millimetres(kObstacleHeightSlack_m + kSameSurfaceSlope * distance_m),
                           static_cast<std::uint8_t>(std::lround(steps))});
      }
    }
  }
  return offsets;
}

std::vector<SurfaceMap::Offset> SurfaceMap::SlopeOffsets() const {
  const double cell_m = profile_.cell_size_m();
  const auto step = std::max<std::int32_t>(
      1, static_cast<std::int32_t>(
             std::lround(std::min(kSlopeSampleStep_m, options_.slope_radius_m) / cell_m)));
  const auto reach = static_cast<std::int32_t>(options_.slope_radius_m / cell_m);
  std::vector<Offset> offsets;
  for (std::int32_t dy = -(reach / step) * step; dy <= reach; dy += step) {
    for (std::int32_t dx = -(reach / step) * step; dx <= reach; dx += step) {
      const double distance_m = std::hypot(dx, dy) * cell_m;
      if (distance_m <= options_.slope_radius_m) {
        offsets.push_back(
            {dx, dy, Millimetres(options_.max_step_m + kSameSurfaceSlope * distance_m), 0});
      }
    }
  }
  return offsets;
}

Status SurfaceMap::AddMemory(std::size_t bytes) {
  memory_bytes_ += bytes;
  if (memory_bytes_ > options_.max_memory_bytes) {
    return Status(StatusCode::kResourceExhausted,
                  StrCat("plan: ", tiles_.size(), " tiles need more than the limit of ",
                         options_.max_memory_bytes, " bytes"));
  }
  return {};
}

Result<std::int32_t> SurfaceMap::Load(const TileId& id) {
  if (const auto known = slots_.find(id); known != slots_.end()) {
    return known->second;
  }
  const Result<const Tile*> tile = source_.Get(id);
  if (!tile) {
    return Error(tile.error().WithContext(StrCat("plan: tile ", id)));
  }
  std::int32_t slot = SurfaceTile::kNotThere;
  if (*tile != nullptr) {
    auto surface = MakeSurfaceTile(**tile, id, profile_, options_);
    if (!surface) {
      return Error(surface.error());
    }
    slot = static_cast<std::int32_t>(tiles_.size());
    tiles_.push_back(std::make_unique<SurfaceTile>(std::move(*surface)));
    if (Status status = AddMemory(tiles_.back()->memory_bytes()); !status.ok()) {
      return Error(std::move(status));
    }
  }
  slots_.emplace(id, slot);
  return slot;
}

Result<std::int32_t> SurfaceMap::Ready(const TileId& id) {
  const auto slot = Load(id);
  if (slot && *slot != SurfaceTile::kNotThere) {
    if (Status status = MakeReady(static_cast<std::uint32_t>(*slot)); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return slot;
}

Status SurfaceMap::MakeReady(std::uint32_t slot) {
  SurfaceTile& tile = *tiles_[slot];
  if (tile.is_ready) {
    return {};
  }
  for (std::int32_t i = 0; i < 9; ++i) {
    const TileId id{tile.id.level, tile.id.x + i % 3 - 1, tile.id.y + i / 3 - 1};
    const bool is_in_range = std::min(id.x, id.y) >= TileId::kMinCoordinate &&
                             std::max(id.x, id.y) <= TileId::kMaxCoordinate;
    const auto around = is_in_range ? Load(id) : Result<std::int32_t>(SurfaceTile::kNotThere);
    if (!around) {
      return around.error();
    }
    tile.around[static_cast<std::size_t>(i)] = *around;
  }
  tile.is_ready = true;
  for (std::size_t i = 0; i < tile.around.size(); ++i) {
    if (tile.around[i] != SurfaceTile::kNotThere) {
      InflateInto(tile, i);
    }
  }
  return {};
}

CellNodes SurfaceMap::Cell(const SurfaceTile& home, std::int32_t x, std::int32_t y) const {
  std::size_t around = 4;
  if (x < 0) {
    x += side_;
    around -= 1;
  } else if (x >= side_) {
    x -= side_;
    around += 1;
  }
  if (y < 0) {
    y += side_;
    around -= 3;
  } else if (y >= side_) {
    y -= side_;
    around += 3;
  }
  const std::int32_t slot = home.around[around];
  if (slot == SurfaceTile::kNotThere) {
    return {};
  }
  const SurfaceTile& tile = *tiles_[static_cast<std::size_t>(slot)];
  const auto cell = static_cast<std::size_t>(y * side_ + x);
  return {static_cast<std::uint32_t>(slot), tile.cell_begin[cell], tile.cell_begin[cell + 1]};
}

// Obstacles on all four sides: the disc around it lies in theirs.
bool SurfaceMap::IsInsideObstacle(const SurfaceTile& tile, const SurfaceNode& node) const {
  const std::int32_t x = node.cell % side_;
  const std::int32_t y = node.cell / side_;
  if (x == 0 || y == 0 || x == side_ - 1 || y == side_ - 1) {
    return false;
  }
  for (const std::int32_t step : {-1, 1, -side_, side_}) {
    const auto cell = static_cast<std::size_t>(node.cell + step);
    bool is_obstacle = false;
    for (std::uint32_t i = tile.cell_begin[cell]; i < tile.cell_begin[cell + 1]; ++i) {
      const SurfaceNode& other = tile.nodes[i];
      is_obstacle = is_obstacle || (other.Has(SurfaceNode::kObstacle) &&
                                    std::abs(std::int64_t{other.altitude_mm} - node.altitude_mm) <=
                                        Millimetres(kObstacleHeightSlack_m));
    }
    if (!is_obstacle) {
      return false;
    }
  }
  return true;
}

void SurfaceMap::InflateInto(SurfaceTile& target, std::size_t neighbour) {
  const SurfaceTile& from = *tiles_[static_cast<std::size_t>(target.around[neighbour])];
  const std::int32_t shift_x = (static_cast<std::int32_t>(neighbour % 3) - 1) * side_;
  const std::int32_t shift_y = (static_cast<std::int32_t>(neighbour / 3) - 1) * side_;
  const auto reach =
      static_cast<std::int32_t>(options_.clearance_reach_m() / profile_.cell_size_m());
  const auto is_within_reach = [&](std::int32_t v) {
    return v >= -reach && v < side_ + reach;
  };
  for (const SurfaceNode& node : from.nodes) {
    const std::int32_t x = shift_x + node.cell % side_;
    const std::int32_t y = shift_y + node.cell / side_;
    if (node.Has(SurfaceNode::kObstacle) && is_within_reach(x) && is_within_reach(y) &&
        !IsInsideObstacle(from, node)) {
      StampDisc(target, x, y, BandOf(from, node));
    }
  }
}

SurfaceMap::HeightBand SurfaceMap::BandOf(const SurfaceTile& tile, const SurfaceNode& node) {
  const std::int64_t altitude_mm = node.altitude_mm;
  HeightBand band{altitude_mm, altitude_mm - kHighest_mm, altitude_mm + kHighest_mm};
  for (std::uint32_t i = tile.cell_begin[node.cell]; i < tile.cell_begin[node.cell + 1U]; ++i) {
    const std::int64_t middle_mm = (altitude_mm + tile.nodes[i].altitude_mm) / 2;
    if (tile.nodes[i].altitude_mm > altitude_mm) {
      band.high_mm = std::min(band.high_mm, middle_mm);
    } else if (tile.nodes[i].altitude_mm < altitude_mm) {
      band.low_mm = std::max(band.low_mm, middle_mm);
    }
  }
  return band;
}

void SurfaceMap::StampDisc(SurfaceTile& target,
                           std::int32_t x,
                           std::int32_t y,
                           const HeightBand& band) {
  for (const Offset& offset : clearance_offsets_) {
    const std::int32_t cx = x + offset.dx;
    const std::int32_t cy = y + offset.dy;
    if (cx < 0 || cy < 0 || cx >= side_ || cy >= side_) {
      continue;
    }
    const auto cell = static_cast<std::size_t>(cy * side_ + cx);
    for (std::uint32_t i = target.cell_begin[cell]; i < target.cell_begin[cell + 1]; ++i) {
      SurfaceNode& node = target.nodes[i];
      const std::int64_t height_mm = node.altitude_mm;
      if (std::abs(height_mm - band.altitude_mm) <= offset.height_limit_mm &&
          height_mm >= band.low_mm && height_mm <= band.high_mm) {
        node.clearance = std::min(node.clearance, offset.clearance);
      }
    }
  }
}

double SurfaceMap::Clearance(const SurfaceNode& node) const {
  const double reach_m = options_.clearance_reach_m();
  return node.clearance == SurfaceNode::kFar ? reach_m : reach_m * node.clearance / kClearanceSteps;
}

// Fits a plane to the same surface around the node: what is near in height, measured and free.
bool SurfaceMap::IsGentle(const SurfaceTile& home, const SurfaceNode& node) const {
  const std::int32_t x = node.cell % side_;
  const std::int32_t y = node.cell / side_;
  PlaneFit fit;
  std::size_t known = 0;
  for (const Offset& offset : slope_offsets_) {
    const CellNodes cell = Cell(home, x + offset.dx, y + offset.dy);
    std::int32_t nearest_mm = offset.height_limit_mm + 1;
    const SurfaceNode* nearest = nullptr;
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      const SurfaceNode& other = tiles_[cell.slot]->nodes[i];
      const std::int64_t apart_mm = std::abs(std::int64_t{other.altitude_mm} - node.altitude_mm);
      if (apart_mm < nearest_mm) {
        nearest_mm = static_cast<std::int32_t>(apart_mm);
        nearest = &other;
      }
    }
    if (nearest == nullptr) {
      continue;
    }
    ++known;
    if (nearest->Has(SurfaceNode::kMeasured) && !nearest->Has(SurfaceNode::kObstacle)) {
      fit.Add(offset.dx, offset.dy, 1e-3 * (nearest->altitude_mm - node.altitude_mm));
    }
  }
  const double support = static_cast<double>(known) / static_cast<double>(slope_offsets_.size());
  const auto gradient = fit.Gradient();
  return support >= options_.min_support && gradient.has_value() &&
         *gradient <=
             std::tan(options_.max_slope_deg * std::numbers::pi / 180.0) * profile_.cell_size_m();
}

bool SurfaceMap::IsDrivable(const NodeRef& ref) {
  SurfaceNode& node = tiles_[ref.slot]->nodes[ref.node];
  if (!node.Has(SurfaceNode::kAnalysed)) {
    node.flags |= SurfaceNode::kAnalysed;
    const bool is_clear =
        node.clearance == SurfaceNode::kFar || Clearance(node) > options_.inflation_m();
    if (node.Has(SurfaceNode::kOpen) && is_clear && IsGentle(*tiles_[ref.slot], node)) {
      node.flags |= SurfaceNode::kDrivable;
    }
  }
  return node.Has(SurfaceNode::kDrivable);
}

Status SurfaceMap::PrepareSearch(std::uint32_t slot) {
  SurfaceTile& tile = *tiles_[slot];
  if (!tile.search.empty() || tile.nodes.empty()) {
    return {};
  }
  tile.search.resize(tile.nodes.size());
  return AddMemory(tile.search.size() * sizeof(SearchNode));
}

}  // namespace atlas
