// The tiles that a vehicle holds, as its planner asks for them.
#pragma once

#include <cstdint>

#include "client/vehicle/tile_store.h"
#include "core/planning/tile_source.h"

namespace atlas {

// Asks nobody: what is not held is not driven over. Bring the way there first (AtlasView::Around,
// Prefetch). A tile whose file cannot be read is an error, one that was damaged is not held.
class HeldTiles : public TileSource {
 public:
  // The store outlives it.
  explicit HeldTiles(TileStore& store) : store_(store) {}

  Result<const Tile*> Get(const TileId& id) override;
  // Tiles that were asked for and not held. Some of these the atlas may not have either.
  std::uint64_t not_held() const { return not_held_; }

 private:
  TileStore& store_;
  Tile lent_;
  std::uint64_t not_held_ = 0;
};

}  // namespace atlas
