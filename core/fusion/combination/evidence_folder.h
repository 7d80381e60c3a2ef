// Occupancy and columns of one cell's layers: the say of each stretch, in the order in which they
// saw the layer last. The fold saturates, so that no stretch has more than its say, no evidence
// becomes certainty, and what was seen last counts; but what follows a vehicle.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/combination/cell_layers.h"
#include "core/fusion/combination/recent_drives.h"
#include "core/fusion/segment/column_evidence.h"
#include "core/fusion/segment/segment_view.h"
#include "core/tile/column_lattice.h"
#include "core/tile/tile.h"

namespace atlas {

// Reused from cell to cell.
class EvidenceFolder {
 public:
  // `profile` must outlive the folder.
  explicit EvidenceFolder(const MapProfile& profile)
      : profile_(profile), can_stand_(profile.preset != FusionPreset::kPaper), drives_(profile) {}

  // Appends the layers to `out`, complete. Segments in canonical order with the layer of each, or
  // kNoLayer; `above_mm`: the altitude of the cell's next layer above these, or null.
  void Fold(std::span<const SegmentView> segments,
            std::span<const std::uint32_t> labels,
            std::span<const CellLayer> layers,
            const std::int32_t* above_mm,
            std::vector<TileLayer>& out);

 private:
  // Of one layer, so far.
  struct Sum {
    ColumnSpan span;
    int occupancy = 0;
    bool has_stood = false;  // occupied once, and not measured free since
    ColumnSum column;
  };

  void Begin(std::span<const CellLayer> layers, const std::int32_t* above_mm);
  void SortByTime(std::span<const SegmentView> segments);
  // Whether what the segment says of occupancy is about this layer: it measured it, or guessed it
  // right.
  bool SpeaksOfOccupancy(const Segment& segment, const CellLayer& layer) const;
  static TileLayer Finish(const CellLayer& surface, const Sum& sum);

  const MapProfile& profile_;
  const bool can_stand_;  // what is seen of a column stands on its layer
  RecentDrives drives_;
  std::vector<Sum> sums_;
  std::vector<std::uint32_t> order_;
};

}  // namespace atlas
