// A store's tiles from a daemon that is asked only when something is to be had: it tells what
// changes around the vehicle (client/connection/atlas_watch.h), and a sync follows.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "client/connection/atlas_watch.h"
#include "client/vehicle/atlas_link.h"
#include "client/vehicle/link_feed.h"
#include "client/vehicle/tile_feed.h"
#include "core/geometry/map_area.h"

namespace atlas {

struct WatchedFeedOptions {
  // Fetched and watched around the disc that is asked for: the vehicle drives so far before it asks
  // again.
  double margin_m = 30.0;
  std::chrono::milliseconds interval{250};  // between two things that the daemon tells
  // After so long it asks all the same: a link that carries nothing any more looks like silence.
  std::chrono::milliseconds max_silence{60'000};
  // Before another watch, when the daemon refused one or ended it. It is asked every time then.
  std::chrono::milliseconds watch_pause{10'000};
};

class WatchedFeed final : public TileFeed {
 public:
  // The link outlives the feed.
  explicit WatchedFeed(AtlasLink& link, const WatchedFeedOptions& options = {})
      : link_(link), options_(options), feed_(&link) {}

  // Of a disc: the disc and its margin. Complete without a request, with the revision of the last
  // one, while nothing in it was told to have changed, and the store holds what it held then. Of
  // any other area, and else, as LinkFeed. From when a store had no room for such a disc on, of the
  // disc alone, and with a request in every call.
  Result<StoreSyncReport> Sync(TileStore& store,
                               const MapArea& area,
                               const AroundOptions& options) override;
  void NoteDropped(const TileStore& store, const std::vector<TileId>& dropped) override {
    feed_.NoteDropped(store, dropped);
  }

 private:
  using Clock = std::chrono::steady_clock;

  struct Watched {
    DiscArea disc;  // with its margin
    std::uint8_t finest_level = 0;
    SectionBits sections = 0;
  };
  // What the last sync left behind, if there is nothing to ask for.
  struct Settled {
    const TileStore* store = nullptr;
    std::uint64_t store_changes = 0;
    std::uint64_t revision = 0;
    Clock::time_point since;
  };

  bool Covers(const DiscArea& disc, const AroundOptions& options) const;
  void Begin(AtlasClient& client, const DiscArea& disc, const AroundOptions& options);
  // Whether all is as it was settled.
  bool IsQuiet(const TileStore& store);
  void Listen(std::chrono::milliseconds time);

  AtlasLink& link_;
  WatchedFeedOptions options_;
  LinkFeed feed_;
  std::optional<Watched> watched_;
  std::optional<AtlasWatch> watch_;  // none: refused, ended, or its connection is gone
  Clock::time_point next_watch_ = Clock::time_point::min();
  std::optional<Settled> settled_;
  bool had_room_ = true;
};

}  // namespace atlas
