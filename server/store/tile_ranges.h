// Which keys of the tile table a question is about: key ranges of a rectangle, and the coarse
// region (shard) that a tile or a position belongs to.
#pragma once

#include <cstdint>
#include <vector>

#include "server/store/store_types.h"

namespace atlas {

// Keys as SQL integers, both ends included.
struct KeyRange {
  std::int64_t first = 0;
  std::int64_t last = 0;

  friend bool operator==(const KeyRange&, const KeyRange&) = default;
};

// Ascending, disjoint ranges that hold every key of the rectangle and few others: at most
// `max_ranges` (4 or more).
std::vector<KeyRange> CoverRect(const TileRect& rect, std::size_t max_ranges);

// All keys of a level.
KeyRange LevelRange(std::uint8_t level);

// The keys of the level-0 tiles under a tile: its own on level 0.
KeyRange Level0Range(const TileId& id);
// The level-0 tiles under those of a rectangle.
TileRect Level0Rect(const TileRect& rect);
// The tile of `level` over a level-0 tile.
TileId AncestorOf(const TileId& level0, std::uint8_t level);

// The coarse region that rows are addressed by: 1024 x 1024 level-0 tiles (13 km at 0.1 m cells).
// A coarser tile is its own region.
std::int64_t ShardOf(const TileId& id);

}  // namespace atlas
