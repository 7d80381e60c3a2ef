// Makes one tile from what the store holds, from nothing: level 0 from keyframes, the others from
// their children. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "core/base/status.h"
#include "core/tile/tile.h"
#include "server/service/fusion/stored_keyframes.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct BuiltTile {
  std::uint64_t revision = 0;          // the tile reflects every change up to it
  std::optional<TileContent> content;  // none: no cell has a layer
};

std::optional<TileContent> ToContent(const Tile& tile, const MapProfile& profile);

// Decoded tiles that were built lately, by payload hash: what their parents are made of.
class TileCache {
 public:
  explicit TileCache(std::size_t max_bytes) : tiles_(max_bytes) {}

  std::shared_ptr<const Tile> Find(std::uint64_t payload_hash) { return tiles_.Find(payload_hash); }
  void Insert(std::uint64_t payload_hash, std::shared_ptr<const Tile> tile);

 private:
  LruCache<Tile> tiles_;
};

class TileBuilder {
 public:
  // `tile_bytes`: what fusing one tile may take, for observations. The caches must outlive the
  // builder.
  TileBuilder(AtlasStore& store,
              KeyframeCache& keyframes,
              TileCache& tiles,
              std::size_t tile_bytes);

  // Asked before each keyframe: a failed status ends the building with it.
  using CheckStop = std::function<Status()>;

  // kInvalidData names the damaged keyframe, pose or child tile.
  Result<BuiltTile> Build(const TileId& id, const CheckStop& check_stop);

 private:
  Result<BuiltTile> BuildFromKeyframes(const TileId& id, const CheckStop& check_stop);
  Result<BuiltTile> BuildFromChildren(const TileId& id);
  Result<std::shared_ptr<const Tile>> ReadChild(const TileSummary& child);

  AtlasStore& store_;
  KeyframeCache& keyframes_;
  TileCache& tiles_;
  const std::size_t tile_bytes_;
  const MapProfile profile_;
};

}  // namespace atlas
