#include "core/fusion/combination/cell_combiner.h"

namespace atlas {

void CellCombiner::Combine(std::span<SegmentView> segments,
                           const std::int32_t* above_mm,
                           std::vector<TileLayer>& out) {
  if (profile_.preset == FusionPreset::kBounded) {
    segments = segments.first(choice_.MoveLatestToFront(segments));
  }
  layer_builder_.Build(segments);
  folder_.Fold(segments, layer_builder_.labels(), layer_builder_.layers(), above_mm, out);
}

}  // namespace atlas
