#include "server/service/history/past_tiles.h"

#include <array>
#include <utility>

#include "core/fusion/tile_fusion.h"
#include "core/tile/tile_pyramid.h"
#include "server/service/fusion/stored_keyframes.h"

namespace atlas {
namespace {

// Those of the four that some keyframe ever touched: the others need no look.
Result<std::vector<TileId>> TouchedChildren(AtlasStore& store, const TileId& id) {
  const std::array<TileId, 4> children = id.Children();
  const TileId& first = children.front();
  const TileId& last = children.back();
  std::vector<TileId> touched;
  const Status status =
      store.ScanFootprintTiles({first.level, first.x, first.y, last.x, last.y},
                               [&touched](const TileId& child) { touched.push_back(child); });
  return status.ok() ? Result<std::vector<TileId>>(std::move(touched)) : Error(status);
}

std::size_t IndexInParent(const TileId& id) {
  return static_cast<std::size_t>((id.x & 1) + 2 * (id.y & 1));
}

}  // namespace

PastTiles::PastTiles(AtlasStore& store, PastOptions options)
    : store_(store), profile_(store.identity().profile), options_(std::move(options)) {}

Result<Tile> PastTiles::Build(const TileId& id, const OnTile& on_tile) {
  if (Status status = options_.check_stop(); !status.ok()) {
    return Error(std::move(status));
  }
  auto tile = id.level == 0 ? BuildFromKeyframes(id) : BuildFromChildren(id, on_tile);
  if (tile && !tile->is_empty()) {
    if (Status status = on_tile(*tile); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return tile;
}

Result<Tile> PastTiles::BuildFromKeyframes(const TileId& id) {
  const auto sources = store_.GatherTileAt(id, options_.revision);
  if (!sources) {
    return Error(sources.error());
  }
  const auto frames = PlaceKeyframes(sources->keyframes);
  if (!frames) {
    return Error(frames.error());
  }
  const auto source = [&](std::size_t i) -> Result<KeyframeCache::Handle> {
    if (Status status = options_.check_stop(); !status.ok()) {
      return Error(std::move(status));
    }
    return ReadKeyframe((*frames)[i], store_, *options_.keyframes);
  };
  auto tile = FuseTile(id, *frames, source, profile_);
  if (!tile && tile.error().code() == StatusCode::kInvalidData) {
    // A keyframe that a compaction dropped since it was gathered is no damage.
    if (Status status = store_.CheckRevision(options_.revision); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return tile;
}

Result<Tile> PastTiles::BuildFromChildren(const TileId& id, const OnTile& on_tile) {
  const auto touched = TouchedChildren(store_, id);
  if (!touched) {
    return Error(touched.error());
  }
  std::array<Tile, 4> tiles;
  std::array<const Tile*, 4> children{};
  for (const TileId& child : *touched) {
    auto tile = Build(child, on_tile);
    if (!tile) {
      return tile;
    }
    if (!tile->is_empty()) {
      const std::size_t i = IndexInParent(child);
      tiles[i] = std::move(*tile);
      children[i] = &tiles[i];
    }
  }
  return BuildParentTile(id, children, profile_);
}

}  // namespace atlas
