// Occupancy and columns of one cell's layers. Each session's observations fold in time order to one
// increment; increments fold in the order of their last observation. Both folds saturate, so that
// no session has more than its say and no evidence becomes certainty.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/cell_layers.h"
#include "core/fusion/column_evidence.h"
#include "core/fusion/fusion_input.h"
#include "core/fusion/observation.h"
#include "core/tile/column_lattice.h"
#include "core/tile/tile.h"

namespace atlas {

// Reused from cell to cell.
class EvidenceFolder {
 public:
  // Both must outlive the folder.
  EvidenceFolder(const FusionInput& input, const MapProfile& profile);

  // Appends the cell's layers to `out`, complete, and remembers the sessions that took part.
  void Fold(std::span<const Observation> observations,
            std::span<const std::uint32_t> labels,
            std::span<const CellLayer> layers,
            std::vector<TileLayer>& out);

  // By session: whether an observation of it was used in any cell so far.
  const std::vector<bool>& contributed() const { return contributed_; }

 private:
  // What one session says about one layer.
  struct Increment {
    std::uint32_t layer = 0;
    std::uint32_t last_time_rank = 0;
    std::int16_t occupancy = 0;
    bool has_column = false;
    ColumnEvidence column;
  };

  void PrepareSpans(std::span<const CellLayer> layers);
  void FoldSession(std::span<const Observation> observations,
                   std::span<const std::uint32_t> labels,
                   std::uint32_t session);
  void FoldObservation(const Observation& observation, std::uint32_t layer);
  Increment& IncrementOf(std::uint32_t layer);
  void SortByTime(std::span<const Observation> observations);
  void Publish(std::span<const CellLayer> layers, std::vector<TileLayer>& out);

  const FusionInput& input_;
  const MapProfile& profile_;
  std::array<std::int16_t, 3> occupancy_units_;  // by Occupancy

  std::vector<ColumnSpan> spans_;
  std::vector<Increment> increments_;
  std::vector<std::uint32_t> slots_;  // by layer: its increment of this session, or kNoLayer
  std::vector<std::uint32_t> time_order_;
  std::vector<ColumnEvidence> columns_;
  std::vector<bool> contributed_;
};

}  // namespace atlas
