#include "core/fusion/tile_fusion.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/fusion/block_gatherer.h"
#include "core/fusion/cell_layers.h"
#include "core/fusion/evidence_folder.h"
#include "core/fusion/fusion_input.h"
#include "core/fusion/sigma_table.h"

namespace atlas {
namespace {

// The layers of a tile while its blocks are worked through: cells in the order of the blocks.
struct BlockwiseLayers {
  struct Range {
    std::uint32_t begin = 0;
    std::uint32_t count = 0;
  };
  std::vector<TileLayer> layers;
  std::vector<Range> cells;  // by cell of the tile, row-major
};

class TileFuser {
 public:
  TileFuser(const TileId& id, const FusionInput& input, const MapProfile& profile)
      : side_(profile.tile_cells),
        sigmas_(profile, input.max_radius_cells),
        gatherer_(id, input, sigmas_, profile),
        layer_builder_(input, sigmas_, profile),
        folder_(input, profile) {
    result_.cells.resize(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_));
  }

  Status Run(const KeyframeSource& source, std::size_t max_bytes) {
    const std::int32_t blocks = side_ / BlockGatherer::kBlockCells;
    const std::int32_t band = gatherer_.RowsWithin(max_bytes);
    for (std::int32_t first = 0; first < blocks; first += band) {
      const std::int32_t rows = std::min(band, blocks - first);
      ATLAS_RETURN_IF_ERROR(gatherer_.Gather(first, rows, source));
      for (std::int32_t y = first; y < first + rows; ++y) {
        for (std::int32_t x = 0; x < blocks; ++x) {
          FuseBlock(x, y);
        }
      }
    }
    return {};
  }

  const BlockwiseLayers& result() const { return result_; }

  const std::vector<bool>& contributed() const { return folder_.contributed(); }

 private:
  void FuseBlock(std::int32_t block_x, std::int32_t block_y) {
    for (std::int32_t y = 0; y < BlockGatherer::kBlockCells; ++y) {
      for (std::int32_t x = 0; x < BlockGatherer::kBlockCells; ++x) {
        const auto row = static_cast<std::uint32_t>(block_y * BlockGatherer::kBlockCells + y);
        const auto column = static_cast<std::uint32_t>(block_x * BlockGatherer::kBlockCells + x);
        FuseCell(gatherer_.Observations(block_x, block_y, x, y),
                 result_.cells[std::size_t{row} * static_cast<std::uint32_t>(side_) + column]);
      }
    }
  }

  void FuseCell(std::span<const Observation> observations, BlockwiseLayers::Range& range) {
    range.begin = static_cast<std::uint32_t>(result_.layers.size());
    if (!observations.empty()) {
      layer_builder_.Build(observations);
      folder_.Fold(observations, layer_builder_.labels(), layer_builder_.layers(), result_.layers);
    }
    range.count = static_cast<std::uint32_t>(result_.layers.size()) - range.begin;
  }

  std::int32_t side_;
  SigmaTable sigmas_;
  BlockGatherer gatherer_;
  CellLayerBuilder layer_builder_;
  EvidenceFolder folder_;
  BlockwiseLayers result_;
};

void AppendCells(const BlockwiseLayers& blockwise, Tile& tile) {
  tile.layers.reserve(blockwise.layers.size());
  for (std::size_t cell = 0; cell < blockwise.cells.size(); ++cell) {
    const auto first = blockwise.layers.begin() + blockwise.cells[cell].begin;
    tile.layers.insert(tile.layers.end(), first, first + blockwise.cells[cell].count);
    tile.cell_begin[cell + 1] = static_cast<std::uint32_t>(tile.layers.size());
  }
}

}  // namespace

Result<Tile> FuseTile(const TileId& id,
                      std::span<const FrameOnMap> frames,
                      const KeyframeSource& source,
                      const MapProfile& profile,
                      std::size_t max_bytes) {
  assert(id.level == 0);
  const FusionInput input = PrepareFusion(id, frames, profile);
  Tile tile = EmptyTile(id, profile);
  if (input.frames.empty()) {
    return tile;
  }
  TileFuser fuser(id, input, profile);
  if (Status status = fuser.Run(source, max_bytes); !status.ok()) {
    return Error(std::move(status));
  }
  AppendCells(fuser.result(), tile);
  for (std::size_t i = 0; i < input.sessions.size(); ++i) {
    if (fuser.contributed()[i]) {
      tile.contributors.push_back(*input.sessions[i].key);  // sessions are sorted
    }
  }
  return tile;
}

Tile FuseTile(const TileId& id,
              std::span<const PlacedKeyframe> keyframes,
              const MapProfile& profile) {
  std::vector<FrameOnMap> frames;
  frames.reserve(keyframes.size());
  for (const PlacedKeyframe& k : keyframes) {
    frames.push_back({k.key, k.time_ms, k.placement, k.keyframe->grid});
  }
  const auto in_memory = [keyframes](std::size_t i) -> Result<std::shared_ptr<const Keyframe>> {
    return keyframes[i].keyframe;
  };
  constexpr std::size_t kCacheBytes = std::size_t{1} << 20;       // asking again costs nothing here
  return *FuseTile(id, frames, in_memory, profile, kCacheBytes);  // memory does not fail
}

}  // namespace atlas
