// The surveys of a tile's stretches to its cells: which of their segments are one surface, and what
// they say of it together.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/cell_layers.h"
#include "core/fusion/evidence_folder.h"
#include "core/fusion/segment_view.h"
#include "core/fusion/stretch_survey.h"

namespace atlas {

struct SurveyedStretch {
  const StretchSurvey* survey = nullptr;
  std::uint32_t session = 0;  // FusionStretch's numbers
  std::uint32_t vehicle = 0;
};

class TileCombiner {
 public:
  // Both must outlive the combiner. `sessions` is their number.
  TileCombiner(const SigmaTable& sigmas, const MapProfile& profile, std::size_t sessions)
      : profile_(profile),
        layer_builder_(sigmas, profile),
        folder_(profile),
        contributed_(sessions, false) {}

  // Appends the layers of a band's cells, row by row, to `tile`: bands in order. `stretches` in
  // canonical order, surveyed over this band.
  void Combine(const TileBand& band, std::span<const SurveyedStretch> stretches, Tile& tile);

  // By session: whether a segment of it was used in any cell so far.
  const std::vector<bool>& contributed() const { return contributed_; }

 private:
  void CollectSegments(std::span<const SurveyedStretch> stretches, std::size_t cell);
  void CombineCell(std::vector<TileLayer>& out);

  const MapProfile& profile_;
  CellLayerBuilder layer_builder_;
  EvidenceFolder folder_;
  std::vector<SegmentView> segments_;
  std::vector<bool> contributed_;
};

}  // namespace atlas
