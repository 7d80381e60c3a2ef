#include "core/fusion/tile_fusion.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/fusion/combination/cell_combiner.h"
#include "core/fusion/survey/band_surveys.h"
#include "core/fusion/survey/fusion_stretch.h"

namespace atlas {
namespace {

class TileFuser {
 public:
  TileFuser(std::span<const FrameOnMap> frames,
            const KeyframeSource& source,
            const MapProfile& profile)
      : frames_(frames),
        source_(source),
        profile_(profile),
        sigmas_(profile, MaxRadiusCells(frames)),
        combiner_(sigmas_, profile) {}

  Status Fuse(std::span<const FusionStretch> stretches, std::size_t max_bytes, Tile& tile) {
    const std::int32_t side = profile_.tile_cells;
    const std::int32_t rows = RowsWithin(max_bytes, stretches, profile_);
    contributed_.assign(std::size_t{stretches.back().session} + 1, false);
    for (std::int32_t first = 0; first < side; first += rows) {
      const TileBand band{tile.id, first, std::min(rows, side - first)};
      ATLAS_RETURN_IF_ERROR(FuseBand(band, stretches, tile));
    }
    NameContributors(stretches, tile);
    return {};
  }

 private:
  Status FuseBand(const TileBand& band, std::span<const FusionStretch> stretches, Tile& tile) {
    auto surveys = BandSurveys::Survey(band, stretches, frames_, source_, {profile_, sigmas_});
    if (!surveys) {
      return surveys.error();
    }
    const std::size_t first = static_cast<std::size_t>(band.first_row) * profile_.tile_cells;
    for (std::size_t cell = 0; cell < surveys->cells(); ++cell) {
      surveys->Collect(cell, segments_);
      CombineCell(stretches, tile.layers);
      tile.cell_begin[first + cell + 1] = static_cast<std::uint32_t>(tile.layers.size());
    }
    return {};
  }

  void CombineCell(std::span<const FusionStretch> stretches, std::vector<TileLayer>& out) {
    if (segments_.empty()) {
      return;
    }
    combiner_.Combine(segments_, nullptr, out);
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      if (combiner_.IsUsed(i)) {
        contributed_[stretches[segments_[i].stretch].session] = true;
      }
    }
  }

  void NameContributors(std::span<const FusionStretch> stretches, Tile& tile) const {
    for (const FusionStretch& stretch : stretches) {
      const bool is_new = tile.contributors.empty() || tile.contributors.back() != *stretch.key;
      if (contributed_[stretch.session] && is_new) {
        tile.contributors.push_back(*stretch.key);  // in canonical order
      }
    }
  }

  std::span<const FrameOnMap> frames_;
  const KeyframeSource& source_;
  const MapProfile& profile_;
  SigmaTable sigmas_;
  CellCombiner combiner_;
  std::vector<SegmentView> segments_;  // of a cell
  std::vector<bool> contributed_;      // by session: a segment of it was used in some cell
};

}  // namespace

Result<Tile> FuseTile(const TileId& id,
                      std::span<const FrameOnMap> frames,
                      const KeyframeSource& source,
                      const MapProfile& profile,
                      std::size_t max_bytes) {
  assert(id.level == 0);
  Tile tile = EmptyTile(id, profile);
  const std::vector<FusionStretch> stretches = CutStretches(id, frames, profile);
  if (stretches.empty()) {
    return tile;
  }
  TileFuser fuser(frames, source, profile);
  if (Status status = fuser.Fuse(stretches, max_bytes, tile); !status.ok()) {
    return Error(std::move(status));
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
  return *FuseTile(id, frames, in_memory, profile);  // memory does not fail
}

}  // namespace atlas
