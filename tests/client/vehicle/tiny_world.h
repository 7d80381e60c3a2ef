// A small atlas that changes, and all that its tiles ever were.
#pragma once

#include <cstdint>
#include <map>
#include <random>

#include "client/vehicle/tile_files.h"
#include "core/tile/tile_codec.h"

namespace atlas {

// Tiles of 16 cells, 4 levels.
MapProfile TinyProfile();
AtlasKey TinyAtlas();

class TinyWorld {
 public:
  struct Stored {
    std::uint64_t revision = 0;
    EncodedTile encoded;
  };

  // The tile at level 0 with one surface at this altitude, and its parents.
  void Set(std::int32_t x, std::int32_t y, std::int32_t altitude_mm);
  // This one of level 0, and its parents.
  void Put(const Tile& tile) {
    ++revision_;
    Store(tile);
    BuildParents(tile.id);
  }
  void Erase(std::int32_t x, std::int32_t y);
  void ChangeSome(std::mt19937& random, int side, int changes);

  const std::map<TileId, Stored>& tiles() const { return tiles_; }
  // By payload hash: all that a tile ever was.
  const std::map<std::uint64_t, Bytes>& past_blobs() const { return past_blobs_; }
  std::uint64_t revision() const { return revision_; }

 private:
  void BuildParents(TileId id);
  void Store(const Tile& tile);

  std::map<TileId, Tile> decoded_;
  std::map<TileId, Stored> tiles_;
  std::map<std::uint64_t, Bytes> past_blobs_;
  std::uint64_t revision_ = 0;
};

// Tiles at (0, 0) to (side - 1, side - 1), each at another altitude.
TinyWorld SquareWorld(int side);

}  // namespace atlas
