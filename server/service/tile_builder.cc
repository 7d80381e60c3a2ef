#include "server/service/tile_builder.h"

#include <array>
#include <utility>

#include "core/base/str_cat.h"
#include "core/fusion/tile_fusion.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_pyramid.h"
#include "server/service/stored_keyframes.h"

namespace atlas {

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

TileBuilder::TileBuilder(AtlasStore& store, KeyframeCache& keyframes, std::size_t tile_bytes)
    : store_(store),
      keyframes_(keyframes),
      tile_bytes_(tile_bytes),
      profile_(store.identity().profile) {}

Result<BuiltTile> TileBuilder::Build(const TileId& id) {
  return id.level == 0 ? BuildFromKeyframes(id) : BuildFromChildren(id);
}

Result<BuiltTile> TileBuilder::BuildFromKeyframes(const TileId& id) {
  const auto sources = store_.GatherTile(id);
  if (!sources) {
    return Error(sources.error());
  }
  const auto frames = PlaceKeyframes(sources->keyframes);
  if (!frames) {
    return Error(frames.error());
  }
  const auto source = [&](std::size_t i) {
    return ReadKeyframe((*frames)[i], store_, keyframes_);
  };
  const auto tile = FuseTile(id, *frames, source, profile_, tile_bytes_);
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

}  // namespace atlas
