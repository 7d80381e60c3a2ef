// How far a node is from the nearest obstacle on its own surface.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/map_profile.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface/surface_tiles.h"

namespace atlas {

class ObstacleClearance {
 public:
  // The tiles outlive it.
  ObstacleClearance(const SurfaceTiles& tiles, const PlanOptions& options);

  // In steps of Metres; kFar where there is no obstacle within reach. Requires that the node is
  // joined.
  std::uint8_t Of(const NodeRef& ref);

  // Metres to the nearest obstacle, at most the reach.
  double Metres(std::uint8_t clearance) const;

 private:
  // The nearest obstacle so far, its distance squared in cells; none: one beyond the reach.
  struct Search {
    const SurfaceTile& home;
    const std::vector<std::uint64_t>& rows;
    const SurfaceNode& node;
    std::int32_t x;
    std::int32_t y;
    std::int32_t nearest_squared;
  };

  void SearchRow(Search& search, std::int32_t dy) const;
  // Obstacles of a tile and of what is loaded within reach of it, a bit a cell, row by row.
  struct Rows {
    std::vector<std::uint64_t> words;
    std::uint16_t added = 0;  // of the tiles around, as SurfaceTile::linked
  };
  const std::vector<std::uint64_t>& RowsOf(std::uint32_t slot);
  void AddRows(const SurfaceTile& tile,
               std::int32_t shift_x,
               std::int32_t shift_y,
               std::vector<std::uint64_t>& rows) const;
  bool IsInTheWay(const Search& search, std::int32_t dx, std::int32_t dy) const;
  bool ReachesTo(const CellNodes& cell, std::uint32_t obstacle, std::int64_t height_mm) const;

  const SurfaceTiles& tiles_;
  double reach_m_;
  std::int32_t reach_cells_;
  std::int32_t none_squared_;
  std::int32_t side_;
  std::int32_t row_words_;
  std::vector<Rows> rows_;  // by slot; empty until asked for
  // By the squared distance in cells.
  std::vector<std::uint8_t> steps_;
  std::vector<std::int32_t> height_limit_mm_;
};

}  // namespace atlas
