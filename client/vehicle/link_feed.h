// A store's tiles from a daemon, over a link that may be down.
#pragma once

#include "client/vehicle/atlas_link.h"
#include "client/vehicle/store_sync.h"
#include "client/vehicle/tile_feed.h"

namespace atlas {

class LinkFeed final : public TileFeed {
 public:
  // Null: never anybody to ask. Outlives the feed.
  explicit LinkFeed(AtlasLink* link) : link_(link) {}

  // Errors as of AtlasLink::Client and SyncStore.
  Result<StoreSyncReport> Sync(TileStore& store,
                               const MapArea& area,
                               const AroundOptions& options) override;

 private:
  AtlasLink* link_;
  StoreSyncRest rest_;
};

}  // namespace atlas
