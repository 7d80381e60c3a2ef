// The segments of one cell to its layers: which of them are one surface, and what they say of it
// together.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/combination/bounded_choice.h"
#include "core/fusion/combination/cell_layers.h"
#include "core/fusion/combination/evidence_folder.h"
#include "core/fusion/segment/segment_view.h"

namespace atlas {

// Reused from cell to cell.
class CellCombiner {
 public:
  // Both must outlive the combiner.
  CellCombiner(const SigmaTable& sigmas, const MapProfile& profile)
      : profile_(profile), choice_(profile), layer_builder_(sigmas, profile), folder_(profile) {}

  // Appends the layers of a cell, or of a part of it (CellPart) above which `above_mm` is the
  // altitude of the cell's next layer, if there is one, to `out`. Segments in canonical order;
  // those that do not count come to stand behind those that do (preset bounded).
  void Combine(std::span<SegmentView> segments,
               const std::int32_t* above_mm,
               std::vector<TileLayer>& out);
  const MapProfile& profile() const { return profile_; }
  // What they were made of.
  std::span<const CellLayer> layers() const { return layer_builder_.layers(); }
  // Whether segment `i`, as they stand then, is part of a layer.
  bool IsUsed(std::size_t i) const {
    const auto labels = layer_builder_.labels();
    return i < labels.size() && labels[i] != kNoLayer;
  }

 private:
  const MapProfile& profile_;
  BoundedChoice choice_;
  CellLayerBuilder layer_builder_;
  EvidenceFolder folder_;
};

}  // namespace atlas
