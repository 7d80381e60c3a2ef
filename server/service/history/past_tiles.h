// Tiles as they were at one revision, fused again: level 0 from the keyframes, poses and session
// states of then, the others from their children. Depth first, so that at most four tiles of each
// level are held. For one request, one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "core/base/status.h"
#include "core/keyframe/keyframe.h"
#include "core/tile/tile.h"
#include "server/service/fusion/stored_keyframes.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct PastOptions {
  std::uint64_t revision = 0;
  std::shared_ptr<KeyframeCache> keyframes;
  // Asked before each keyframe; a failed status ends the work with it.
  std::function<Status()> check_stop;
};

class PastTiles {
 public:
  // Told of every tile that is built on the way, children before their parents, each level in key
  // order; of empty ones not. A failed status ends the work with it.
  using OnTile = std::function<Status(const Tile&)>;

  PastTiles(AtlasStore& store, PastOptions options);

  // Empty where there was none. kInvalidData names the damaged keyframe, pose or session; errors of
  // the revision as AtlasStore::CheckRevision.
  Result<Tile> Build(const TileId& id, const OnTile& on_tile);

  std::uint64_t revision() const { return options_.revision; }

 private:
  Result<Tile> BuildFromKeyframes(const TileId& id);
  Result<Tile> BuildFromChildren(const TileId& id, const OnTile& on_tile);

  AtlasStore& store_;
  const MapProfile profile_;
  PastOptions options_;
};

}  // namespace atlas
