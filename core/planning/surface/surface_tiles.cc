// Loading, and cells beyond a tile's edge.
#include "core/planning/surface/surface_tiles.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

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
      cell_m_(AtLevel(profile.cell_size_m(), level)) {}

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
    auto surface = MakeSurfaceTile(**tile, id, profile_, options_);
    if (!surface) {
      return Error(surface.error());
    }
    slot = static_cast<std::int32_t>(tiles_.size());
    tiles_.push_back(std::make_unique<SurfaceTile>(std::move(*surface)));
    if (Status status = budget_.AddMemory(tiles_.back()->memory_bytes()); !status.ok()) {
      return Error(std::move(status));
    }
  }
  slots_.emplace(id.Key(), slot);
  return slot;
}

Status SurfaceTiles::JoinAround(std::uint32_t slot) {
  SurfaceTile& tile = *tiles_[slot];
  for (std::size_t i = 0; i < tile.around.size(); ++i) {
    const TileId id{tile.id.level, tile.id.x + static_cast<std::int32_t>(i % 3) - 1,
                    tile.id.y + static_cast<std::int32_t>(i / 3) - 1};
    const bool is_in_range = std::min(id.x, id.y) >= TileId::kMinCoordinate &&
                             std::max(id.x, id.y) <= TileId::kMaxCoordinate;
    const auto loaded = is_in_range ? Load(id) : Result<std::int32_t>(SurfaceTile::kNotThere);
    if (!loaded) {
      return loaded.error();
    }
    tile.around[i] = *loaded;
  }
  tile.is_joined = true;
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
