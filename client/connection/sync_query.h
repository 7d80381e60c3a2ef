// What a client asks of a sync and what it is told (docs/protocol.md, "Sync"): plain values, no
// messages. Metres in the world frame.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/bytes.h"
#include "core/geometry/map_area.h"
#include "core/geometry/tile_id.h"

namespace atlas {

// Sections of a tile as bits, 1 << its number (docs/formats/tile.md). All of them is more than each
// of those that are known.
using SectionBits = std::uint64_t;
inline constexpr SectionBits kEverySection = ~SectionBits{0};

// Tiles that are held with the same sections of each. No tile twice, nor beside its block.
struct HeldGroup {
  struct OneTile {
    TileId id;
    std::uint64_t payload_hash = 0;
  };
  // 8 x 8 tiles: those with the keys block << 6 | i for which bit i of the mask is set.
  struct Block {
    std::uint64_t block = 0;
    std::uint64_t mask = 0;
    std::uint64_t digest = 0;  // Hash64 over key and payload hash of each, in key order
  };
  SectionBits sections = kEverySection;
  std::vector<OneTile> tiles;
  std::vector<Block> blocks;
};

struct SyncQuery {
  MapArea area;
  std::uint8_t finest_level = 0;
  std::uint8_t coarsest_level = 0;  // 0: the atlas's
  SectionBits sections = kEverySection;
  std::vector<HeldGroup> held;
  std::uint64_t budget_bytes = 0;  // of the whole reply; 0: none
  // Of the reply, and of the wait in it; 0: no end to the one, and none of the other.
  std::chrono::milliseconds timeout{0};
  // Of the call, whatever the link does: what has not come then is left on its way (`rest` of the
  // summary). 0: the call ends with the reply.
  std::chrono::milliseconds give_up{0};
  std::uint64_t wait_revision = 0;  // until the tiles reflect it; 0: do not wait
  Bytes cursor;                     // of the summary before, with area and levels as they were
  bool takes_deltas = false;        // to held tiles that are told one by one
};

struct SyncRest;  // of a reply that is on its way (AtlasClient::Continue)

struct SyncSummary {
  // Null: the reply is whole. Else it says what came so far, and no more than that.
  std::shared_ptr<SyncRest> rest;
  std::uint64_t tiles = 0;
  std::uint64_t deltas = 0;  // of these
  std::uint64_t bytes = 0;   // of the reply's frames
  std::uint64_t revision = 0;
  Bytes cursor;                          // empty: that was all
  std::vector<TileId> removed;           // held ones that are no more
  std::vector<bool> current_tiles;       // of the held ones, through all groups: is what it was
  std::vector<bool> current_blocks;      // the same of blocks
  std::uint64_t not_modified_tiles = 0;  // in blocks or by themselves
  // Held ones of which some tile is not what it was: tell their tiles one by one, without a cursor.
  std::vector<std::uint64_t> differing_blocks;
};

}  // namespace atlas
