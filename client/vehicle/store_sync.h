// Brings a store up to date with a daemon, in as many requests as it takes within a budget.
#pragma once

#include <memory>

#include "client/connection/atlas_client.h"
#include "client/vehicle/tile_feed.h"
#include "client/vehicle/tile_store.h"
#include "core/base/status.h"

namespace atlas {

// A reply that a call left on its way.
struct StoreSyncRest {
  std::shared_ptr<SyncRest> reply;  // null: none
  AskedSections asked;
};

// What is held and the cursor of `query` are set here; its budget and its times bound all
// requests together. Each tile is in the store as soon as it came: after a failure the store is as
// good as it was, or better. kConflict: the daemon serves another atlas.
// `rest`: what an earlier call left on its way, which comes first; afterwards what
// this one leaves there.
Result<StoreSyncReport> SyncStore(AtlasClient& client,
                                  TileStore& store,
                                  SyncQuery query,
                                  StoreSyncRest& rest);
// For calls without an end of their own (`give_up`): what is on its way then is thrown away.
Result<StoreSyncReport> SyncStore(AtlasClient& client, TileStore& store, SyncQuery query);

}  // namespace atlas
