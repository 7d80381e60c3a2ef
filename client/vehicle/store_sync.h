// Brings a store up to date with a daemon, in as many requests as it takes within a budget.
#pragma once

#include "client/connection/atlas_client.h"
#include "client/vehicle/tile_feed.h"
#include "client/vehicle/tile_store.h"
#include "core/base/status.h"

namespace atlas {

// What is held and the cursor of `query` are set here; its budget and its timeout bound all
// requests together. Each tile is in the store as soon as it came: after a failure the store is as
// good as it was, or better. kConflict: the daemon serves another atlas.
Result<StoreSyncReport> SyncStore(AtlasClient& client, TileStore& store, SyncQuery query);

}  // namespace atlas
