// A store's tiles from a daemon, over a link that may be down.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "client/vehicle/atlas_link.h"
#include "client/vehicle/fine_reach.h"
#include "client/vehicle/store_sync.h"
#include "client/vehicle/tile_feed.h"

namespace atlas {

class LinkFeed final : public TileFeed {
 public:
  // Null: never anybody to ask. Outlives the feed.
  explicit LinkFeed(AtlasLink* link) : link_(link) {}

  // Errors as of AtlasLink::Client and SyncStore. Of a disc for which the store has no room it
  // follows what FineReach says, and what it held beyond that, it holds no more, unless it belongs
  // to another area that was brought up to date since the last disc. Of any other area it fetches
  // what there is room for beside the last disc, and beside what is held of the area.
  Result<StoreSyncReport> Sync(TileStore& store,
                               const MapArea& area,
                               const AroundOptions& options) override;
  // After each Sync of a disc: what it follows of the next one depends on it.
  void NoteDropped(const TileStore& store, const std::vector<TileId>& dropped) override;

  // The last call left a reply on its way: the next one begins with what is left of it, and
  // whatever else is asked of the daemon in between throws that away.
  bool is_under_way() const { return rest_.reply != nullptr; }

 private:
  using Clock = std::chrono::steady_clock;

  Result<StoreSyncReport> SyncArea(AtlasClient& client,
                                   TileStore& store,
                                   const MapArea& area,
                                   const AroundOptions& options,
                                   Clock::time_point end);
  Result<StoreSyncReport> SyncParts(AtlasClient& client,
                                    TileStore& store,
                                    const AroundOptions& options,
                                    Clock::time_point end);
  // Of all levels that are wanted.
  Result<StoreSyncReport> SyncDisc(AtlasClient& client,
                                   TileStore& store,
                                   const DiscArea& disc,
                                   const AroundOptions& options,
                                   Clock::time_point end);

  void RemoveOthers(TileStore& store,
                    std::uint8_t finest,
                    const std::optional<MapArea>& beside) const;
  Result<StoreSyncReport> SyncBeside(AtlasClient& client,
                                     TileStore& store,
                                     const MapArea& area,
                                     const AroundOptions& options,
                                     Clock::time_point end);
  // Returns the bytes that may come.
  std::uint64_t MakeRoomBeside(TileStore& store, const MapArea& area, std::uint8_t finest) const;

  AtlasLink* link_;
  StoreSyncRest rest_;
  FineReach reach_;
  std::vector<DiscPart> parts_;    // of the last disc
  bool may_grow_ = false;          // it is held as far as these go
  std::optional<MapArea> beside_;  // up to date since then
};

}  // namespace atlas
