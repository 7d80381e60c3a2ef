// What a client that holds some tiles is to be sent, and in which order: first the coarsest tiles
// of the area, so that there is a map everywhere, then always the tile that removes most error for
// its bytes, around the vehicle and along its way before what lies off it. A tile never comes
// before its parent, so that whatever arrived is a map (docs/protocol.md, "Sync").
//
// A tile's place depends on the stored tile and on where it is, not on what is held or wanted of it
// nor on other tiles: what changes between replies moves nothing else past a cursor.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "server/service/sync/held_tiles.h"
#include "server/service/sync/sync_area.h"
#include "server/service/sync/tile_worth.h"
#include "server/store/tile_block.h"
#include "server/store/tile_index.h"

namespace atlas {

// Where the reply before ended.
struct SyncCursor {
  std::uint64_t revision =
      0;                  // of the atlas, when the first one began: what changed since comes later
  double priority = 0.0;  // of the last tile
  std::uint64_t key = 0;
};

struct SyncRequest {
  SyncArea area;
  std::uint32_t finest_level = 0;
  std::uint32_t coarsest_level = 0;  // 0: the atlas's coarsest
  SectionMask sections = kAllSections;
  HeldTiles held;
  std::optional<SyncCursor> after;
};

struct SyncItem {
  TileSummary tile;
  SectionMask sections = kAllSections;  // those that are wanted and not held
  std::uint64_t held_hash = 0;          // of what is held of it and is not like that any more; or 0
  SectionMask held_sections = 0;        // of that
  double priority = 0.0;
};

struct SyncPlan {
  std::vector<SyncItem> items;
  bool is_cut = false;  // there are more: plan again after the last one
  // A bit for each tile and for each block that is held, by its number, the lowest of the first
  // byte first: held as it is now, with all sections that are wanted. Those outside of the area
  // have none.
  Bytes current_tiles;
  Bytes current_blocks;
  std::uint64_t not_modified = 0;        // tiles, in blocks or by themselves
  std::vector<std::uint64_t> removed;    // keys of those that are held and are no more
  std::vector<std::uint64_t> differing;  // blocks: which of their tiles differ must be asked for
  // Of HeldTiles, in their order, those of which there is something in the area. To the plan that
  // goes on from here the others are nothing.
  std::vector<bool> is_tile_seen;
  std::vector<bool> is_block_seen;

  // Of what is held, with its memory, which assigning `{}` would keep; the items stay.
  void DropHoldings() {
    current_tiles = Bytes();
    current_blocks = Bytes();
    removed = std::vector<std::uint64_t>();
    differing = std::vector<std::uint64_t>();
    is_tile_seen = std::vector<bool>();
    is_block_seen = std::vector<bool>();
  }
  std::size_t item_bytes() const { return items.capacity() * sizeof(SyncItem); }
};

struct SyncLimits {
  std::size_t max_items = 4'096;
  std::size_t max_tiles = 262'144;  // in the area, of all levels
  std::size_t max_blocks = 16'384;  // looked at one by one, a level; larger areas are scanned
  // Without blocking: squares that are compared with a leg of the vehicle's way, those of 256
  // blocks for one that stands. Some 0.3 ms.
  std::size_t max_work_at_once = std::size_t{256} << kTileBlockBits;
};

// kInvalidArgument: levels that the atlas has not, or an area with too many tiles. nullopt: it
// takes the disk or long, and `may_block` is false.
Result<std::optional<SyncPlan>> PlanSync(const SyncRequest& request,
                                         TileIndex& index,
                                         const MapProfile& profile,
                                         bool may_block,
                                         const SyncLimits& limits = {});

}  // namespace atlas
