#include "tests/core/fusion/reference_fusion.h"

#include <algorithm>
#include <set>
#include <vector>

#include "tests/core/fusion/reference_cell.h"

namespace atlas::testing {

Tile ReferenceFuseTile(const TileId& id,
                       std::span<const PlacedKeyframe> keyframes,
                       const MapProfile& profile) {
  std::int32_t max_radius = 1;
  for (const PlacedKeyframe& placed : keyframes) {
    max_radius = std::max(max_radius, placed.keyframe->grid.radius_cells);
  }
  const SigmaTable sigmas(profile, max_radius);
  const std::int64_t side = profile.tile_cells;
  std::set<SessionKey> contributors;
  Tile tile = EmptyTile(id, profile);
  for (std::int64_t cell = 0; cell < side * side; ++cell) {
    CellReference reference(profile, sigmas);
    for (const PlacedKeyframe& placed : keyframes) {
      reference.Look(placed, id.x * side + cell % side, id.y * side + cell / side);
    }
    const std::vector<TileLayer> layers = reference.Fuse();
    tile.layers.insert(tile.layers.end(), layers.begin(), layers.end());
    tile.cell_begin[static_cast<std::size_t>(cell) + 1] =
        static_cast<std::uint32_t>(tile.layers.size());
    contributors.merge(reference.contributors());
  }
  tile.contributors.assign(contributors.begin(), contributors.end());
  return tile;
}

}  // namespace atlas::testing
