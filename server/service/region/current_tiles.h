// The tiles as they are stored.
#pragma once

#include "server/service/region/tile_view.h"
#include "server/store/atlas_store.h"

namespace atlas {

class CurrentTiles final : public TileView {
 public:
  explicit CurrentTiles(AtlasStore& store) : store_(store) {}

  const MapProfile& profile() const override { return store_.identity().profile; }
  Status Scan(const TileRect& rect, const std::function<void(const TileId&)>& visit) override {
    return store_.ScanTiles(rect, [&visit](const TileSummary& tile) { visit(tile.id); });
  }
  Result<std::optional<StoredTile>> Read(const TileId& id) override { return store_.ReadTile(id); }

 private:
  AtlasStore& store_;
};

}  // namespace atlas
