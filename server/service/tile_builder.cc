#include "server/service/tile_builder.h"

#include <array>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "core/fusion/keyframe_placement.h"
#include "core/fusion/tile_fusion.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_pyramid.h"

namespace atlas {
namespace {

std::optional<TileContent> ToContent(const Tile& tile, const MapProfile& profile) {
  if (tile.is_empty()) {
    return std::nullopt;
  }
  EncodedTile encoded = EncodeTile(tile, profile);
  TileContent content{std::move(encoded.blob), encoded.payload_hash, 0, 0};
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    const std::uint32_t layers = tile.cell_begin[cell + 1] - tile.cell_begin[cell];
    content.cells += layers >= 1 ? 1u : 0u;
    content.multilayer_cells += layers >= 2 ? 1u : 0u;
  }
  return content;
}

}  // namespace

TileBuilder::TileBuilder(AtlasStore& store, std::size_t cache_bytes)
    : store_(store), profile_(store.identity().profile), cache_(cache_bytes) {}

Result<BuiltTile> TileBuilder::Build(const TileId& id) {
  return id.level == 0 ? BuildFromKeyframes(id) : BuildFromChildren(id);
}

Result<BuiltTile> TileBuilder::BuildFromKeyframes(const TileId& id) {
  const auto sources = store_.GatherTile(id);
  if (!sources) {
    return Error(sources.error());
  }
  std::vector<FrameOnMap> frames;
  frames.reserve(sources->keyframes.size());
  for (const KeyframeRecord& record : sources->keyframes) {
    const auto placement = PlaceKeyframe(record.pose, record.level_quaternion);
    if (!placement) {
      return Error(placement.error().WithContext(StrCat("keyframe ", record.key)));
    }
    frames.push_back({record.key, record.time_ms, *placement, record.grid});
  }
  const auto load = [&](std::size_t i) -> Result<KeyframeCache::Handle> {
    const KeyframeRecord& record = sources->keyframes[i];
    auto keyframe = cache_.Get(record.id, [this](std::int64_t k) { return LoadKeyframe(k); });
    if (keyframe && (*keyframe)->grid != record.grid) {
      return Error(StatusCode::kInvalidData,
                   StrCat("keyframe ", record.key, ": its grid is not the one of its row"));
    }
    return keyframe ? keyframe
                    : Error(keyframe.error().WithContext(StrCat("keyframe ", record.key)));
  };
  const auto tile = FuseTile(id, frames, load, profile_);
  if (!tile) {
    return Error(tile.error());
  }
  return BuiltTile{sources->revision, ToContent(*tile, profile_)};
}

Result<BuiltTile> TileBuilder::BuildFromChildren(const TileId& id) {
  const auto state = store_.ReadDirtyState();
  if (!state) {
    return Error(state.error());
  }
  const auto stored = store_.ReadTiles(id.Children());
  if (!stored) {
    return Error(stored.error());
  }
  std::array<Tile, 4> tiles;
  std::array<const Tile*, 4> children{};
  for (std::size_t i = 0; i < children.size(); ++i) {
    const auto& child = (*stored)[i];
    if (!child) {
      continue;
    }
    auto tile = DecodeTile(child->blob, profile_);
    if (!tile) {
      return Error(tile.error().WithContext(StrCat("tile ", child->id)));
    }
    tiles[i] = std::move(*tile);
    children[i] = &tiles[i];
  }
  return BuiltTile{state->revision, ToContent(BuildParentTile(id, children, profile_), profile_)};
}

Result<Keyframe> TileBuilder::LoadKeyframe(std::int64_t id) const {
  const auto blob = store_.ReadKeyframeBlob(id);
  if (!blob) {
    return Error(blob.error());
  }
  return DecodeKeyframe(*blob);
}

}  // namespace atlas
