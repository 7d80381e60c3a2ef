// Which tiles an area touches, remembered by block: for who asks about the same ones again and
// again. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/geometry/tile_id.h"
#include "server/service/sync/sync_area.h"
#include "server/store/store_types.h"

namespace atlas {

class TouchedTiles {
 public:
  static constexpr std::size_t kMaxBlocks =
      256;  // then it forgets them all: 64 tiles and some 40 bytes each

  // Of the levels that are asked for, none else is.
  TouchedTiles(SyncArea area, std::uint32_t finest_level, std::uint32_t coarsest_level);

  // As of the area; false on other levels.
  bool Has(const TileId& id);
  // That it compared with the area since it was made.
  std::size_t compared_blocks() const { return compared_blocks_; }

 private:
  std::uint64_t TouchedOf(std::uint64_t block) const;

  const SyncArea area_;
  const std::uint32_t finest_level_;
  std::vector<TileRect> bounds_;  // by level, from the finest on
  std::unordered_map<std::uint64_t, std::uint64_t>
      touched_;  // by block: a bit a tile, in key order
  std::size_t compared_blocks_ = 0;
};

}  // namespace atlas
