#include "tests/bench/updates/batch_build.h"

#include <array>
#include <cstddef>
#include <utility>

#include "core/fusion/tile_fusion.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_pyramid.h"
#include "server/service/fusion/stored_keyframes.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kKeyframeBytes = std::size_t{1} << 30;  // so that each is decoded once

class BatchBuilder {
 public:
  explicit BatchBuilder(AtlasStore& store)
      : store_(store), profile_(store.identity().profile), keyframes_(kKeyframeBytes) {}

  // Children before parents.
  Status Build(const TileId& id) {
    Result<Tile> tile = id.level == 0 ? Fuse(id) : Combine(id);
    if (!tile) return tile.error();
    if (!tile->is_empty()) {
      hashes_.emplace(id, EncodeTile(*tile, profile_).payload_hash);
    }
    tiles_.insert_or_assign(id, *std::move(tile));
    return {};
  }
  PayloadHashes TakeHashes() { return std::move(hashes_); }

 private:
  Result<Tile> Fuse(const TileId& id) {
    const auto sources = store_.GatherTile(id, 0);
    if (!sources) return Error(sources.error());
    const auto frames = PlaceKeyframes(sources->keyframes);
    if (!frames) return Error(frames.error());
    const auto source = [&](std::size_t i) {
      return ReadKeyframe((*frames)[i], store_, keyframes_);
    };
    return FuseTile(id, *frames, source, profile_);
  }

  Result<Tile> Combine(const TileId& id) {
    std::array<const Tile*, 4> children{};
    const std::array<TileId, 4> ids = id.Children();
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (!tiles_.contains(ids[i])) {
        if (Status status = Read(ids[i]); !status.ok()) return Error(std::move(status));
      }
      const Tile& child = tiles_.at(ids[i]);
      children[i] = child.is_empty() ? nullptr : &child;
    }
    return BuildParentTile(id, children, profile_);
  }

  Status Read(const TileId& id) {
    const auto stored = store_.ReadTile(id);
    if (!stored) return stored.error();
    Result<Tile> tile = *stored ? DecodeTile((*stored)->blob, profile_) : Tile();
    if (!tile) return tile.error();
    tiles_.emplace(id, *std::move(tile));
    return {};
  }

  AtlasStore& store_;
  const MapProfile profile_;
  KeyframeCache keyframes_;
  std::map<TileId, Tile> tiles_;
  PayloadHashes hashes_;
};

}  // namespace

Result<PayloadHashes> BuildBatch(AtlasStore& store, const std::set<TileId>& ids) {
  BatchBuilder builder(store);
  for (const TileId& id : ids) {  // lower levels first
    if (Status status = builder.Build(id); !status.ok()) return Error(std::move(status));
  }
  return builder.TakeHashes();
}

}  // namespace atlas::testing
