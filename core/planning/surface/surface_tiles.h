// The tiles of one pyramid level that a plan has looked at: loaded as needed, linked to those
// around them, with room for a search.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <unordered_map>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/planning/plan_budget.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface/surface_tile.h"
#include "core/planning/tile_source.h"

namespace atlas {

// The nodes [begin, end) of one cell, lowest first; none where there is no tile.
struct CellNodes {
  std::uint32_t slot = NodeRef::kNone;
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
};

class SurfaceTiles {
 public:
  // All outlive the tiles.
  SurfaceTiles(TileSource& source,
               const MapProfile& profile,
               const PlanOptions& options,
               PlanBudget& budget,
               std::uint8_t level);

  // The slot of a tile, or kNotThere. kResourceExhausted beyond the memory limit, kInvalidData for
  // a tile of another profile, and whatever the source reports.
  Result<std::int32_t> Load(const TileId& id);
  // kNotThere also where nobody loaded it.
  std::int32_t Find(const TileId& id) const {
    const auto known = slots_.find(id.Key());
    return known == slots_.end() ? SurfaceTile::kNotThere : known->second;
  }
  // Loads what whatever asks for a node looks at around it: around its cell, or cell (x, y) of a
  // tile. Errors as of Load.
  Status Join(const NodeRef& ref) {
    const std::int32_t cell = node(ref).cell;
    return Join(ref.slot, cell % side_, cell / side_);
  }
  Status Join(std::uint32_t slot, std::int32_t x, std::int32_t y) {
    const std::uint32_t wanted = Around(x, y) & ~std::uint32_t{tiles_[slot]->joined};
    return wanted == 0 ? Status() : JoinAround(slot, wanted);
  }
  // Makes room for the search in a tile. kResourceExhausted beyond the memory limit.
  Status PrepareSearch(std::uint32_t slot) {
    return tiles_[slot]->search.empty() ? MakeRoom(slot) : Status();
  }
  // Forgets what a search left in the tiles.
  void ClearSearch();

  SurfaceTile& tile(std::uint32_t slot) { return *tiles_[slot]; }
  const SurfaceTile& tile(std::uint32_t slot) const { return *tiles_[slot]; }
  SurfaceNode& node(const NodeRef& ref) { return tiles_[ref.slot]->nodes[ref.node]; }
  const SurfaceNode& node(const NodeRef& ref) const { return tiles_[ref.slot]->nodes[ref.node]; }
  SearchNode& search(const NodeRef& ref) { return tiles_[ref.slot]->search[ref.node]; }
  // Of a node that a search reached.
  float cost(const NodeRef& ref) const { return tiles_[ref.slot]->search[ref.node].cost; }
  std::size_t size() const { return tiles_.size(); }
  std::int32_t side() const { return side_; }
  std::uint8_t level() const { return level_; }
  double cell_m() const { return cell_m_; }

  // Cell (x, y) counted from the corner of `home`, up to one tile beyond it. Requires that it is
  // within reach of a cell that is joined, or else it may seem not to be there.
  CellNodes Cell(const SurfaceTile& home, std::int32_t x, std::int32_t y) const {
    std::size_t around = 4;
    if (x < 0) {
      x += side_;
      around -= 1;
    } else if (x >= side_) {
      x -= side_;
      around += 1;
    }
    if (y < 0) {
      y += side_;
      around -= 3;
    } else if (y >= side_) {
      y -= side_;
      around += 3;
    }
    const std::int32_t slot = home.around[around];
    if (slot == SurfaceTile::kNotThere) {
      return {};
    }
    const SurfaceTile& tile = *tiles_[static_cast<std::size_t>(slot)];
    const auto cell = static_cast<std::uint32_t>(y * side_ + x);
    return {static_cast<std::uint32_t>(slot), tile.cell_begin[cell], tile.cell_begin[cell + 1]};
  }
  // Of the cell's nodes the one nearest to the altitude, none that is `limit_mm` away or more.
  NodeRef Nearest(const CellNodes& cell, std::int32_t altitude_mm, std::int64_t limit_mm) const {
    NodeRef nearest;
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      const std::int64_t apart_mm =
          std::abs(std::int64_t{tiles_[cell.slot]->nodes[i].altitude_mm} - altitude_mm);
      if (apart_mm < limit_mm) {
        limit_mm = apart_mm;
        nearest = {cell.slot, i};
      }
    }
    return nearest;
  }

  // In cells of the level, of the world.
  std::int64_t CellX(const NodeRef& ref) const {
    return tiles_[ref.slot]->origin_x + node(ref).cell % side_;
  }
  std::int64_t CellY(const NodeRef& ref) const {
    return tiles_[ref.slot]->origin_y + node(ref).cell / side_;
  }

 private:
  // Of the tiles around, those within reach of a cell: a bit each, as SurfaceTile::joined.
  std::uint32_t Around(std::int32_t x, std::int32_t y) const {
    const std::uint32_t columns = 2U | (x < reach_ ? 1U : 0U) | (x >= side_ - reach_ ? 4U : 0U);
    return (columns << 3) | (y < reach_ ? columns : 0U) | (y >= side_ - reach_ ? columns << 6 : 0U);
  }
  Status JoinAround(std::uint32_t slot, std::uint32_t wanted);
  // With those around it that are loaded, both ways.
  void Link(std::uint32_t slot);
  Status MakeRoom(std::uint32_t slot);

  TileSource& source_;
  const MapProfile& profile_;
  const PlanOptions& options_;
  PlanBudget& budget_;
  std::uint8_t level_;
  std::int32_t side_;
  double cell_m_;
  std::int32_t reach_;  // cells: how far a search, clearance, slopes and gaps look around a node
  // By TileId::Key; kNotThere where the source has none.
  std::unordered_map<std::uint64_t, std::int32_t> slots_;
  std::vector<std::unique_ptr<SurfaceTile>> tiles_;
};

}  // namespace atlas
