// Makes one tile from what the store holds: level 0 from keyframes, the others from their children.
// Used by the workers and, with a cache of its own, by verification. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/status.h"
#include "core/tile/tile.h"
#include "server/service/keyframe_cache.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct BuiltTile {
  std::uint64_t revision = 0;          // the tile reflects every change up to it
  std::optional<TileContent> content;  // none: no cell has a layer
};

class TileBuilder {
 public:
  TileBuilder(AtlasStore& store, std::size_t cache_bytes);

  // kInvalidData names the damaged keyframe, pose or child tile.
  Result<BuiltTile> Build(const TileId& id);

 private:
  Result<BuiltTile> BuildFromKeyframes(const TileId& id);
  Result<BuiltTile> BuildFromChildren(const TileId& id);
  Result<Keyframe> LoadKeyframe(std::int64_t id) const;

  AtlasStore& store_;
  const MapProfile profile_;
  KeyframeCache cache_;
};

}  // namespace atlas
