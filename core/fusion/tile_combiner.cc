#include "core/fusion/tile_combiner.h"

#include "core/fusion/bounded_choice.h"

namespace atlas {

void TileCombiner::Combine(const TileBand& band,
                           std::span<const SurveyedStretch> stretches,
                           Tile& tile) {
  const std::size_t side = profile_.tile_cells;
  const std::size_t first = static_cast<std::size_t>(band.first_row) * side;
  const std::size_t cells = static_cast<std::size_t>(band.rows) * side;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    CollectSegments(stretches, cell);
    if (!segments_.empty()) {
      CombineCell(tile.layers);
    }
    tile.cell_begin[first + cell + 1] = static_cast<std::uint32_t>(tile.layers.size());
  }
}

void TileCombiner::CollectSegments(std::span<const SurveyedStretch> stretches, std::size_t cell) {
  segments_.clear();
  for (std::uint32_t number = 0; number < stretches.size(); ++number) {
    const SurveyedStretch& stretch = stretches[number];
    const StretchSurvey& survey = *stretch.survey;
    for (std::uint32_t i = survey.First(cell); i != Segment::kNone; i = survey.At(i).next) {
      const Segment& segment = survey.At(i);
      segments_.push_back({&segment, survey.frames()[segment.last_frame].time_ms, number,
                           stretch.session, stretch.vehicle});
    }
  }
}

void TileCombiner::CombineCell(std::vector<TileLayer>& out) {
  if (profile_.preset == FusionPreset::kBounded) {
    KeepLatestSegments(profile_, segments_);
  }
  layer_builder_.Build(segments_);
  folder_.Fold(segments_, layer_builder_.labels(), layer_builder_.layers(), out);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    if (layer_builder_.labels()[i] != kNoLayer) {
      contributed_[segments_[i].session] = true;
    }
  }
}

}  // namespace atlas
