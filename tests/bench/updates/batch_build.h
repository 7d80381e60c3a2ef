// Tiles made from nothing, as plainly as it goes: level 0 one by one from all of its keyframes,
// nothing kept for the next time, the others from their children. What a change is measured
// against.
#pragma once

#include <cstdint>
#include <map>
#include <set>

#include "core/base/status.h"
#include "core/geometry/tile_id.h"
#include "server/store/atlas_store.h"

namespace atlas::testing {

using PayloadHashes = std::map<TileId, std::uint64_t>;

// Encoded and thrown away but for their hashes, of those that hold something. Children that are not
// among `ids` come from the store.
Result<PayloadHashes> BuildBatch(AtlasStore& store, const std::set<TileId>& ids);

}  // namespace atlas::testing
