#include "core/fusion/cell_combiner.h"

#include "core/fusion/bounded_choice.h"

namespace atlas {

void CellCombiner::Combine(std::vector<SegmentView>& segments, std::vector<TileLayer>& out) {
  if (profile_.preset == FusionPreset::kBounded) {
    KeepLatestSegments(profile_, segments);
  }
  layer_builder_.Build(segments);
  folder_.Fold(segments, layer_builder_.labels(), layer_builder_.layers(), out);
}

}  // namespace atlas
