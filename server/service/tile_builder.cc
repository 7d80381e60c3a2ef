#include "server/service/tile_builder.h"

#include <array>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "core/fusion/fusion_stretch.h"
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

TileBuilder::TileBuilder(AtlasStore& store, const TileBuilderOptions& options)
    : store_(store),
      profile_(store.identity().profile),
      sigmas_(profile_, Keyframe::kMaxRadiusCells),
      options_(options),
      keyframes_(options.keyframe_bytes),
      surveys_(options.surveys) {}

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
    frames.push_back({record.key, record.time_ms, *placement, record.grid,
                      static_cast<std::uint64_t>(record.id)});
  }
  const auto load = [&](std::size_t i) -> Result<KeyframeCache::Handle> {
    const KeyframeRecord& record = sources->keyframes[i];
    auto keyframe = keyframes_.Get(record.id, [this](std::int64_t k) { return LoadKeyframe(k); });
    if (keyframe && (*keyframe)->grid != record.grid) {
      return Error(StatusCode::kInvalidData,
                   StrCat("keyframe ", record.key, ": its grid is not the one of its row"));
    }
    return keyframe ? keyframe
                    : Error(keyframe.error().WithContext(StrCat("keyframe ", record.key)));
  };
  const auto tile = Fuse(id, frames, load);
  if (!tile) {
    return Error(tile.error());
  }
  return BuiltTile{sources->revision, ToContent(*tile, profile_)};
}

// From the surveys of the last time, where they are still there. They are taken out meanwhile: what
// fails is lost, and two workers never share.
Result<Tile> TileBuilder::Fuse(const TileId& id,
                               std::span<const FrameOnMap> frames,
                               const KeyframeSource& source) {
  std::optional<TileSurveys> surveys = surveys_.Take(id);
  if (!FitsInMemory(id, frames)) {
    return FuseTile(id, frames, source, profile_, options_.tile_bytes);
  }
  if (!surveys) {
    surveys.emplace(id);
  }
  const FusionContext context{profile_, sigmas_};
  const auto work = surveys->Update(frames, source, context);
  if (!work) {
    return Error(work.error());
  }
  Tile tile = surveys->Combine(context);  // kept there too
  surveys_.Put(*std::move(surveys));
  return tile;
}

// Whether a tile's surveys, a segment or two a cell and stretch, may be held at once.
bool TileBuilder::FitsInMemory(const TileId& id, std::span<const FrameOnMap> frames) const {
  constexpr std::size_t kCellBytes = 128;
  const std::size_t cells = std::size_t{profile_.tile_cells} * profile_.tile_cells;
  return profile_.preset != FusionPreset::kPaper &&
         CutStretches(id, frames, profile_).size() * cells * kCellBytes <= options_.tile_bytes;
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
