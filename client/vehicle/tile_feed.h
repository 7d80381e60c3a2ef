// Where a store's tiles come from: a daemon (link_feed.h) or an atlas file (client/atlas_file).
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "client/connection/sync_query.h"
#include "client/vehicle/tile_store.h"
#include "core/base/status.h"

namespace atlas {

struct AroundOptions {
  std::uint8_t finest_level = 0;
  SectionBits sections = kEverySection;  // contributors and surface among them
  std::uint64_t budget_bytes = 0;        // of the replies; 0: none
  // For connecting and for what the daemon sends: a silent or a slow link does not hold a call any
  // longer, and what it had on its way comes first in the next call. At least 1 ms.
  std::chrono::milliseconds deadline{2'000};
};

struct StoreSyncReport {
  std::uint64_t tiles = 0;
  std::uint64_t deltas = 0;  // of these, as differences to what was held
  std::uint64_t bytes = 0;   // of the replies' frames, or of a file's blobs
  std::uint64_t requests = 0;
  std::uint64_t revision = 0;  // the area is at least as new, if `is_complete`
  bool is_complete = false;    // the store got all that the query wants, as far as it has room
  // False: the finest levels of a disc are followed nearby only, or of another area there was no
  // room for all beside the last disc.
  bool has_room = true;
  Status sync;  // of AtlasView::Prefetch: kResourceExhausted where there was no room
};

class TileFeed {
 public:
  TileFeed() = default;
  TileFeed(const TileFeed&) = delete;
  TileFeed& operator=(const TileFeed&) = delete;
  virtual ~TileFeed() = default;

  // Brings the store up to date in an area, coarse levels first, as far as budget and deadline
  // allow. Each tile is in the store as soon as it came: after a failure the store is as good as it
  // was, or better. kConflict: the feed is of another atlas. kUnavailable: there is nobody to ask
  // now. Else the feed's own errors.
  virtual Result<StoreSyncReport> Sync(TileStore& store,
                                       const MapArea& area,
                                       const AroundOptions& options) = 0;
  // For these the store had no room since the last Sync of a disc.
  virtual void NoteDropped(const TileStore& /*store*/, const std::vector<TileId>& /*dropped*/) {}
};

}  // namespace atlas
