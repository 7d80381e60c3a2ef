#include "server/service/history/past_tiles.h"

#include <array>
#include <utility>

#include "core/base/str_cat.h"
#include "core/fusion/keyframe_placement.h"
#include "core/fusion/tile_fusion.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/tile/tile_pyramid.h"

namespace atlas {
namespace {

Result<std::vector<FrameOnMap>> Placed(const std::vector<KeyframeRecord>& records) {
  std::vector<FrameOnMap> frames;
  frames.reserve(records.size());
  for (const KeyframeRecord& record : records) {
    const auto placement = PlaceKeyframe(record.pose, record.level_quaternion);
    if (!placement) {
      return Error(placement.error().WithContext(StrCat("keyframe ", record.key)));
    }
    frames.push_back({record.key, record.time_ms, *placement, record.grid});
  }
  return frames;
}

Result<Keyframe> ReadKeyframe(AtlasStore& store, std::int64_t id) {
  const auto blob = store.ReadKeyframeBlob(id);
  if (!blob) {
    return Error(blob.error());
  }
  return DecodeKeyframe(*blob);
}

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
  const auto frames = Placed(sources->keyframes);
  if (!frames) {
    return Error(frames.error());
  }
  return FuseTile(
      id, *frames, [&](std::size_t i) { return Load(sources->keyframes[i]); }, profile_);
}

Result<KeyframeCache::Handle> PastTiles::Load(const KeyframeRecord& record) {
  if (Status status = options_.check_stop(); !status.ok()) {
    return Error(std::move(status));
  }
  auto keyframe = options_.keyframes->Get(
      record.id, [this](std::int64_t id) { return ReadKeyframe(store_, id); });
  if (!keyframe) {
    return Error(keyframe.error().WithContext(StrCat("keyframe ", record.key)));
  }
  if ((*keyframe)->grid != record.grid) {
    return Error(StatusCode::kInvalidData,
                 StrCat("keyframe ", record.key, ": its grid is not the one of its row"));
  }
  return keyframe;
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
