#include "server/service/fusion/tile_builder.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "core/fusion/tile_fusion.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_pyramid.h"
#include "server/service/fusion/stored_keyframes.h"

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

void TileCache::Insert(std::uint64_t payload_hash, std::shared_ptr<const Tile> tile) {
  const std::size_t bytes = sizeof(Tile) + tile->layers.size() * sizeof(TileLayer) +
                            tile->cell_begin.size() * sizeof(std::uint32_t);
  tiles_.Insert(payload_hash, std::move(tile), bytes);
}

TileBuilder::TileBuilder(AtlasStore& store,
                         KeyframeCache& keyframes,
                         TileCache& tiles,
                         std::size_t tile_bytes)
    : store_(store),
      keyframes_(keyframes),
      tiles_(tiles),
      tile_bytes_(tile_bytes),
      profile_(store.identity().profile) {}

Result<BuiltTile> TileBuilder::Build(const TileId& id, const CheckStop& check_stop) {
  return id.level == 0 ? BuildFromKeyframes(id, check_stop) : BuildFromChildren(id);
}

Result<BuiltTile> TileBuilder::BuildFromKeyframes(const TileId& id, const CheckStop& check_stop) {
  const auto sources = store_.GatherTile(id, 0);
  if (!sources) {
    return Error(sources.error());
  }
  const auto frames = PlaceKeyframes(sources->keyframes);
  if (!frames) {
    return Error(frames.error());
  }
  const auto source = [&](std::size_t i) -> Result<KeyframeCache::Handle> {
    if (Status status = check_stop(); !status.ok()) {
      return Error(std::move(status));
    }
    return ReadKeyframe((*frames)[i], store_, keyframes_);
  };
  const auto tile = FuseTile(id, *frames, source, profile_, tile_bytes_);
  if (!tile) {
    return Error(tile.error());
  }
  return BuiltTile{sources->revision, ToContent(*tile, profile_)};
}

Result<BuiltTile> TileBuilder::BuildFromChildren(const TileId& id) {
  const std::uint64_t revision = store_.revision();  // before the children are read
  const std::array<TileId, 4> ids = id.Children();
  std::vector<TileSummary> stored;
  const Status scanned =
      store_.ScanTiles({ids[0].level, ids[0].x, ids[0].y, ids[3].x, ids[3].y},
                       [&](const TileSummary& child) { stored.push_back(child); });
  if (!scanned.ok()) {
    return Error(scanned);
  }
  std::array<std::shared_ptr<const Tile>, 4> tiles;
  std::array<const Tile*, 4> children{};
  for (const TileSummary& summary : stored) {
    auto child = ReadChild(summary);
    if (!child) {
      return Error(child.error());
    }
    const auto place = std::find(ids.begin(), ids.end(), summary.id) - ids.begin();
    tiles[static_cast<std::size_t>(place)] = *child;
    children[static_cast<std::size_t>(place)] = child->get();
  }
  auto parent = std::make_shared<const Tile>(BuildParentTile(id, children, profile_));
  BuiltTile built{revision, ToContent(*parent, profile_)};
  if (built.content) {
    tiles_.Insert(built.content->payload_hash, std::move(parent));
  }
  return built;
}

// Null if it has been removed since: then this tile was marked again.
Result<std::shared_ptr<const Tile>> TileBuilder::ReadChild(const TileSummary& child) {
  if (auto found = tiles_.Find(child.payload_hash)) {
    return found;
  }
  const auto stored = store_.ReadTile(child.id);
  if (!stored) {
    return Error(stored.error());
  }
  if (!*stored) {
    return std::shared_ptr<const Tile>();
  }
  auto tile = DecodeTile((*stored)->blob, profile_);
  if (!tile) {
    return Error(tile.error().WithContext(StrCat("tile ", child.id)));
  }
  return std::make_shared<const Tile>(*std::move(tile));
}

}  // namespace atlas
