#include "client/merge/report/fused_tiles.h"

namespace atlas {

std::vector<std::set<TileId>> FusedTiles(const std::set<TileId>& finest, std::uint8_t levels) {
  std::vector<std::set<TileId>> tiles{finest};
  while (tiles.size() < levels) {
    std::set<TileId> coarser;
    for (const TileId& id : tiles.back()) coarser.insert(id.Parent());
    tiles.push_back(std::move(coarser));
  }
  return tiles;
}

}  // namespace atlas
