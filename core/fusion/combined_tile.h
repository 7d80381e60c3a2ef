// The tile that the stretches of a place make, cell by cell. What a change does not reach stays as
// it was when the tile was made last.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/fusion/combination/cell_combiner.h"
#include "core/fusion/combination/cell_part.h"
#include "core/fusion/fusion_context.h"
#include "core/fusion/settled_stretches.h"
#include "core/fusion/survey/cell_set.h"
#include "core/fusion/tile_stretch.h"
#include "core/tile/tile.h"

namespace atlas {

// What the stretches of a tile saw. Of the cells the segments are shared: they are told whether
// they are part of a layer.
struct TileSegments {
  SettledStretches& settled;
  std::span<TileStretch> stretches;     // in canonical order
  std::span<const std::uint32_t> open;  // places of those that are
};

class CombinedTile {
 public:
  // None was made, or its cells are gone.
  bool is_gone() const { return tile_.cell_begin.empty(); }
  const Tile& tile() const { return tile_; }
  std::size_t bytes() const;

  // One without layers: all cells are to be combined.
  void Begin(const TileId& id, const MapProfile& profile);
  // Combines the cells in `touched`; of other cells those segments that were revised, and what they
  // can reach.
  void Update(const CellSet& touched, const TileSegments& from, const FusionContext& context);
  void Clear() { *this = CombinedTile(); }

 private:
  // What follows is of a cell. Appended to `out`, which is the tile to be.
  void Copy(std::size_t cell, CombinedTile& out) const;
  void CombineWhole(std::size_t cell,
                    const TileSegments& from,
                    CellCombiner& combiner,
                    CombinedTile& out);
  bool CombinePart(std::size_t cell,
                   const TileSegments& from,
                   CellCombiner& combiner,
                   CombinedTile& out);
  // What of a cell is combined again: its altitudes, and which of the cell's layers are there.
  struct Part {
    CellPart altitudes;
    std::size_t begin = 0;
    std::size_t end = 0;
  };
  std::optional<Part> FindPart(std::size_t cell,
                               const TileSegments& from,
                               const MapProfile& profile);
  bool IsAtHome(std::size_t cell, const Part& part, const MapProfile& profile) const;
  void CollectPart(const Part& part, const TileSegments& from);
  bool IsCopyable(std::size_t cell, const Part& part, const MapProfile& profile) const;
  CellPart CollectPlainly(std::size_t cell, const TileSegments& from);
  void SetCombined(const TileSegments& from, const CellCombiner& combiner);
  std::span<const std::int32_t> References(std::size_t cell) const;

  Tile tile_;
  std::vector<std::int32_t> references_mm_;  // the altitude of a segment of each layer
  std::vector<SegmentView> segments_;        // of a cell, those that are combined
  std::vector<CellSegment> plain_;           // of a cell, all of them
  std::vector<TileLayer> layers_;            // of a part of a cell
};

}  // namespace atlas
