// Brings a store up to date with a daemon, in as many requests as it takes within a budget.
#pragma once

#include <cstdint>

#include "client/connection/atlas_client.h"
#include "client/vehicle/tile_store.h"
#include "core/base/status.h"

namespace atlas {

struct StoreSyncReport {
  std::uint64_t tiles = 0;
  std::uint64_t deltas = 0;  // of these, as differences to what was held
  std::uint64_t bytes = 0;   // of the replies' frames
  std::uint64_t requests = 0;
  std::uint64_t revision = 0;  // the area is at least as new, if `is_complete`
  bool is_complete = false;    // the store got all that the query wants
};

// What is held and the cursor of `query` are set here; its budget and its timeout bound all
// requests together. Each tile is in the store as soon as it came: after a failure the store is as
// good as it was, or better. kConflict: the daemon serves another atlas.
Result<StoreSyncReport> SyncStore(AtlasClient& client, TileStore& store, SyncQuery query);

}  // namespace atlas
