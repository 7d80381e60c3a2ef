// Makes one tile from what the store holds, from nothing: level 0 from keyframes, the others from
// their children. Thread-safe.
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

std::optional<TileContent> ToContent(const Tile& tile, const MapProfile& profile);

class TileBuilder {
 public:
  // `tile_bytes`: what fusing one tile may take, for observations. `keyframes` must outlive the
  // builder.
  TileBuilder(AtlasStore& store, KeyframeCache& keyframes, std::size_t tile_bytes);

  // kInvalidData names the damaged keyframe, pose or child tile.
  Result<BuiltTile> Build(const TileId& id);

 private:
  Result<BuiltTile> BuildFromKeyframes(const TileId& id);
  Result<BuiltTile> BuildFromChildren(const TileId& id);

  AtlasStore& store_;
  KeyframeCache& keyframes_;
  const std::size_t tile_bytes_;
  const MapProfile profile_;
};

}  // namespace atlas
