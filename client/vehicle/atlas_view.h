// The map around a vehicle, in one call: what is missing comes from the daemon, or from an atlas
// file (client/atlas_file/file_feed.h), as far as bytes and time allow, the rest is what was held.
// Without a link it answers all the same. One thread at a time; the tiles themselves are immutable
// and shared.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <vector>

#include <Eigen/Core>

#include "client/vehicle/atlas_link.h"
#include "client/vehicle/tile_feed.h"
#include "client/vehicle/tile_store.h"
#include "core/base/lru_list.h"
#include "core/base/status.h"
#include "core/tile/tile.h"

namespace atlas {

struct MapAround {
  // For each place the finest that is held, coarse first; a coarse tile is there where a finer one
  // below it is not held, and then also lies under those that are.
  std::vector<std::shared_ptr<const Tile>> tiles;
  std::uint64_t finest_places = 0;  // tiles of the finest level
  std::uint64_t coarse_places = 0;  // tiles that the atlas has below the coarse ones: not held
  bool is_current = false;          // its source said in this call that this is all there is
  std::uint64_t revision = 0;       // of the atlas then
  // Why it is not current; ok where budget or time ended, or see the next. kResourceExhausted: the
  // store has no room for the tiles of the disc.
  Status sync;
  Status disk;  // why it lacks tiles that are held: their files cannot be read now
  StoreSyncReport transfer;

  bool is_finest_everywhere() const { return coarse_places == 0 && disk.ok() && !tiles.empty(); }
};

class AtlasView {
 public:
  // Decoded tiles are kept up to so many bytes. A null link: always offline. Both outlive the view.
  AtlasView(TileStore& store,
            AtlasLink* link,
            std::size_t max_decoded_bytes = std::size_t{256} << 20);
  // The same of another source, which outlives the view.
  AtlasView(TileStore& store,
            TileFeed& feed,
            std::size_t max_decoded_bytes = std::size_t{256} << 20);

  // The tiles that the disc touches. Fails only for what makes no sense (kInvalidArgument).
  Result<MapAround> Around(const Eigen::Vector2d& position_m,
                           double radius_m,
                           const AroundOptions& options = {});
  // Fetches what will be needed along a route of 1 to 256 points that begins where the vehicle is,
  // as far as the store has room beside what was followed around last: else `has_room` is false and
  // `sync` says so.
  Result<StoreSyncReport> Prefetch(const std::vector<Eigen::Vector2d>& route_m,
                                   double half_width_m,
                                   const AroundOptions& options);

 private:
  struct Decoded {
    std::uint64_t payload_hash = 0;
    SectionBits sections = 0;
    std::shared_ptr<const Tile> tile;
  };

  // As TileStore::Read. What does not decode is not held any more.
  Result<std::shared_ptr<const Tile>> Decode(const TileId& id);
  void NoteSync(const Result<StoreSyncReport>& synced, MapAround& map) const;
  // Of what came, or was held, and does not fit into the store.
  void NoteDropped(const DiscArea& disc, std::uint8_t finest, MapAround& map);
  // Decodes; false when a held tile turned out to be damaged, and is not held any more. Where one
  // cannot be read now, it is missing in the map.
  bool Collect(const DiscArea& disc, const AroundOptions& options, MapAround& map);
  std::uint64_t MissingBelow(const Tile& tile,
                             const DiscArea& disc,
                             const std::set<TileId>& unread) const;

  TileStore& store_;
  std::unique_ptr<TileFeed> own_feed_;  // over the link; null: somebody else's
  TileFeed* feed_;
  std::size_t max_decoded_bytes_;
  LruList<Decoded> decoded_;
};

}  // namespace atlas
