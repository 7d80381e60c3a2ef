// The tiles of an earlier revision for a region query: each built when it is read. What building a
// coarse tile made of the finer ones that the query will ask for next is kept, within a bound.
#pragma once

#include <cstddef>
#include <map>

#include "server/service/history/past_tiles.h"
#include "server/service/region/region_query.h"
#include "server/service/region/tile_view.h"

namespace atlas {

class PastView final : public TileView {
 public:
  static constexpr std::size_t kMaxKeptBytes = 16u << 20;

  // `request`: the query, which decides what is worth keeping.
  PastView(AtlasStore& store,
           PastOptions options,
           const RegionRequest& request,
           std::size_t max_kept_bytes = kMaxKeptBytes);

  const MapProfile& profile() const override { return store_.identity().profile; }
  Status Scan(const TileRect& rect, const std::function<void(const TileId&)>& visit) override {
    return store_.ScanFootprintTiles(rect, visit);
  }
  Result<std::optional<StoredTile>> Read(const TileId& id) override;

 private:
  bool IsAskedFor(const TileId& id) const;
  StoredTile Encoded(const Tile& tile) const;
  void Keep(const Tile& tile);
  std::optional<StoredTile> TakeKept(const TileId& id);

  AtlasStore& store_;
  PastTiles tiles_;
  RegionRequest request_;
  std::size_t max_kept_bytes_;
  std::map<TileId, StoredTile> kept_;
  std::size_t kept_bytes_ = 0;
};

}  // namespace atlas
