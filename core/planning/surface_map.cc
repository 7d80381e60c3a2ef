// Loading tiles, and the slope of the plane fitted around a node.
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

// A sample beyond a step and this much slope belongs to another surface.
constexpr double kSameSurfaceSlope = 0.7;
// Slope is sampled no denser than this: closer cells share their noise.
constexpr double kSlopeSampleStep_m = 0.2;

}  // namespace

SurfaceMap::SurfaceMap(TileSource& source, const MapProfile& profile, const PlanOptions& options)
    : source_(source),
      profile_(profile),
      options_(options),
      side_(profile.tile_cells),
      max_gradient_(std::tan(options.max_slope_deg * std::numbers::pi / 180.0) *
                    profile.cell_size_m()),
      inflation_(profile, options),
      slope_samples_(SlopeSamples()) {}

std::vector<SurfaceMap::SlopeSample> SurfaceMap::SlopeSamples() const {
  const double cell_m = profile_.cell_size_m();
  const double step_m = std::min(kSlopeSampleStep_m, options_.slope_radius_m);
  const auto step = std::max(1, static_cast<std::int32_t>(std::lround(step_m / cell_m)));
  const auto steps = static_cast<std::int32_t>(options_.slope_radius_m / cell_m) / step;
  std::vector<SlopeSample> samples;
  for (std::int32_t y = -steps; y <= steps; ++y) {
    for (std::int32_t x = -steps; x <= steps; ++x) {
      const double distance_m = std::hypot(x, y) * step * cell_m;
      if (distance_m <= options_.slope_radius_m) {
        const double limit_m = options_.max_step_m + kSameSurfaceSlope * distance_m;
        samples.push_back(
            {x * step, y * step, static_cast<std::int32_t>(std::lround(limit_m * 1e3))});
      }
    }
  }
  return samples;
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
  if (const auto known = slots_.find(id.Key()); known != slots_.end()) {
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
  slots_.emplace(id.Key(), slot);
  return slot;
}

Result<std::int32_t> SurfaceMap::Ready(const TileId& id) {
  auto slot = Load(id);
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
  std::array<const SurfaceTile*, 9> around{};
  for (std::size_t i = 0; i < around.size(); ++i) {
    const TileId id{tile.id.level, tile.id.x + static_cast<std::int32_t>(i % 3) - 1,
                    tile.id.y + static_cast<std::int32_t>(i / 3) - 1};
    const bool is_in_range = std::min(id.x, id.y) >= TileId::kMinCoordinate &&
                             std::max(id.x, id.y) <= TileId::kMaxCoordinate;
    const auto loaded = is_in_range ? Load(id) : Result<std::int32_t>(SurfaceTile::kNotThere);
    if (!loaded) {
      return loaded.error();
    }
    tile.around[i] = *loaded;
    if (*loaded != SurfaceTile::kNotThere) {
      around[i] = tiles_[static_cast<std::size_t>(*loaded)].get();
    }
  }
  tile.is_ready = true;
  inflation_.Inflate(tile, around);
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
  const auto cell = static_cast<std::uint32_t>(y * side_ + x);
  return {static_cast<std::uint32_t>(slot), tile.cell_begin[cell], tile.cell_begin[cell + 1]};
}

const SurfaceNode* SurfaceMap::SameSurface(const SurfaceTile& home,
                                           const SurfaceNode& node,
                                           const SlopeSample& sample) const {
  const CellNodes cell = Cell(home, node.cell % side_ + sample.dx, node.cell / side_ + sample.dy);
  std::int64_t nearest_mm = std::int64_t{sample.height_limit_mm} + 1;
  const SurfaceNode* nearest = nullptr;
  for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
    const SurfaceNode& other = tiles_[cell.slot]->nodes[i];
    const std::int64_t apart_mm = std::abs(std::int64_t{other.altitude_mm} - node.altitude_mm);
    if (apart_mm < nearest_mm) {
      nearest_mm = apart_mm;
      nearest = &other;
    }
  }
  return nearest;
}

// Whether the surface around the node is known and not too steep. The plane is fitted to what is
// measured and free.
bool SurfaceMap::IsGentle(const SurfaceTile& home, const SurfaceNode& node) const {
  PlaneFit fit;
  std::size_t known = 0;
  for (const SlopeSample& sample : slope_samples_) {
    const SurfaceNode* other = SameSurface(home, node, sample);
    if (other == nullptr) {
      continue;
    }
    ++known;
    if (other->Has(SurfaceNode::kMeasured) && !other->Has(SurfaceNode::kObstacle)) {
      fit.Add(sample.dx, sample.dy, 1e-3 * (other->altitude_mm - node.altitude_mm));
    }
  }
  const double support = static_cast<double>(known) / static_cast<double>(slope_samples_.size());
  const auto gradient = fit.Gradient();
  return support >= options_.min_support && gradient.has_value() && *gradient <= max_gradient_;
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
