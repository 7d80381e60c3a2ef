#include "core/tile/tile.h"

namespace atlas {

Tile EmptyTile(const TileId& id, const MapProfile& profile) {
  const std::size_t cells = std::size_t{profile.tile_cells} * profile.tile_cells;
  Tile tile;
  tile.id = id;
  tile.cell_begin.assign(cells + 1, 0);
  return tile;
}

}  // namespace atlas
