// Loading, and cells beyond a tile's edge.
#include "core/planning/surface/surface_tiles.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::size_t kMiddle = 4;  // of the nine around

std::uint16_t Bit(std::size_t around) {
  return static_cast<std::uint16_t>(1U << around);
}

TileId Beside(const TileId& id, std::size_t around) {
  return {id.level, id.x + static_cast<std::int32_t>(around % 3) - 1,
          id.y + static_cast<std::int32_t>(around / 3) - 1};
}

}  // namespace

SurfaceTiles::SurfaceTiles(TileSource& source,
                           const MapProfile& profile,
                           const PlanOptions& options,
                           PlanBudget& budget,
                           std::uint8_t level)
    : source_(source),
      profile_(profile),
      options_(options),
      budget_(budget),
      level_(level),
      side_(profile.tile_cells),
      cell_m_(AtLevel(profile.cell_size_m(), level)) {
  const double reach_m = std::max({options.clearance_reach_m(), options.slope_radius_m,
                                   options.max_gap_m + profile.cell_size_m()});
  reach_ = 1 + static_cast<std::int32_t>(std::ceil(reach_m / cell_m_));
}

Result<std::int32_t> SurfaceTiles::Load(const TileId& id) {
  if (const auto known = slots_.find(id.Key()); known != slots_.end()) {
    return known->second;
  }
  if (Status status = budget_.CheckTime(); !status.ok()) {
    return Error(std::move(status));
  }
  const Result<const Tile*> tile = source_.Get(id);
  if (!tile) {
    return Error(tile.error().WithContext(StrCat("plan: tile ", id)));
  }
  std::int32_t slot = SurfaceTile::kNotThere;
  if (*tile != nullptr) {
    auto surface = MakeSurfaceTile(**tile, id, profile_, options_, budget_.memory());
    if (!surface) {
      return Error(surface.error());
    }
    slot = static_cast<std::int32_t>(tiles_.size());
    tiles_.push_back(std::make_unique<SurfaceTile>(std::move(*surface)));
    Link(static_cast<std::uint32_t>(slot));
    if (Status status = budget_.AddMemory(tiles_.back()->memory_bytes()); !status.ok()) {
      return Error(std::move(status));
    }
  }
  slots_.emplace(id.Key(), slot);
  return slot;
}

void SurfaceTiles::Link(std::uint32_t slot) {
  SurfaceTile& tile = *tiles_[slot];
  for (std::size_t i = 0; i < tile.around.size(); ++i) {
    const std::int32_t other =
        i == kMiddle ? static_cast<std::int32_t>(slot) : Find(Beside(tile.id, i));
    if (other == SurfaceTile::kNotThere) continue;
    SurfaceTile& beside = *tiles_[static_cast<std::size_t>(other)];
    tile.around[i] = other;
    tile.linked |= Bit(i);
    beside.around[2 * kMiddle - i] = static_cast<std::int32_t>(slot);
    beside.linked |= Bit(2 * kMiddle - i);
  }
}

Status SurfaceTiles::JoinAround(std::uint32_t slot, std::uint32_t wanted) {
  SurfaceTile& tile = *tiles_[slot];
  for (std::size_t i = 0; i < tile.around.size(); ++i) {
    const TileId id = Beside(tile.id, i);
    const bool is_in_range = std::min(id.x, id.y) >= TileId::kMinCoordinate &&
                             std::max(id.x, id.y) <= TileId::kMaxCoordinate;
    if ((wanted & Bit(i)) == 0 || !is_in_range) continue;
    if (const auto loaded = Load(id); !loaded) return loaded.error();
  }
  tile.joined |= static_cast<std::uint16_t>(wanted);
  return {};
}

Status SurfaceTiles::MakeRoom(std::uint32_t slot) {
  SurfaceTile& tile = *tiles_[slot];
  tile.search.resize(tile.nodes.size());
  return budget_.AddMemory(tile.search.capacity() * sizeof(SearchNode));
}

void SurfaceTiles::ClearSearch() {
  for (const auto& tile : tiles_) {
    if (!tile->search.empty()) {
      std::fill(tile->search.begin(), tile->search.end(), SearchNode());
      for (SurfaceNode& node : tile->nodes) {
        node.flags &= static_cast<std::uint8_t>(~(SurfaceNode::kClosed | SurfaceNode::kCorridor));
      }
    }
  }
}

}  // namespace atlas
