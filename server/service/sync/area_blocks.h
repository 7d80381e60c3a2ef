// Which blocks of tiles an area touches. Along a way it looks at the blocks beside each leg and at
// no others, however far the way leads.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "server/service/sync/plan_work.h"
#include "server/service/sync/sync_area.h"

namespace atlas {

// In blocks, of a level.
struct BlockRect {
  std::uint8_t level = 0;
  std::int64_t min_x = 0;
  std::int64_t min_y = 0;
  std::int64_t width = 0;
  std::int64_t height = 0;

  std::int64_t count() const { return width * height; }
};

// What holds all that the area touches.
BlockRect BlocksAround(const SyncArea& area, std::uint8_t level);

// What one block takes once it was found: each of its tiles is compared with each leg.
std::size_t WorkOfBlock(const SyncArea& area);

// The numbers of those in `rect` = BlocksAround() that the area touches, rising, and the work of
// each one is taken. nullopt: that is more than `work` allows. Not for an area that is made of
// tiles.
std::optional<std::vector<std::uint64_t>> FindBlocks(const SyncArea& area,
                                                     const BlockRect& rect,
                                                     PlanWork& work);

}  // namespace atlas
