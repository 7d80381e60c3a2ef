// Which tiles there are, as they are now. Thread-safe; each answer is of one snapshot.
#pragma once

#include <cstdint>
#include <functional>

#include "core/base/status.h"
#include "server/store/tile_block.h"

namespace atlas {

class TileIndex {
 public:
  TileIndex() = default;
  TileIndex(const TileIndex&) = delete;
  TileIndex& operator=(const TileIndex&) = delete;
  virtual ~TileIndex() = default;

  virtual Result<TileBlock> ReadTileBlock(std::uint64_t block) = 0;
  // The same if that takes no disk, else null. Never blocks.
  virtual TileBlock FindTileBlock(std::uint64_t block) = 0;
  // Calls `visit` for every tile in the rectangle, in key order, without reading blobs.
  virtual Status ScanTiles(const TileRect& rect,
                           const std::function<void(const TileSummary&)>& visit) = 0;
};

}  // namespace atlas
