// The part of the atlas that a plan has looked at: tiles loaded as needed, obstacles inflated, and
// the answer to "may a vehicle's middle be here?".
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "core/base/status.h"
#include "core/planning/obstacle_inflation.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface_tile.h"
#include "core/planning/tile_source.h"

namespace atlas {

// The nodes [begin, end) of one cell, lowest first; none where there is no tile.
struct CellNodes {
  std::uint32_t slot = NodeRef::kNone;
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
};

class SurfaceMap {
 public:
  // All three outlive the map. Requires options.Validate(profile).ok().
  SurfaceMap(TileSource& source, const MapProfile& profile, const PlanOptions& options);

  // The slot of a tile whose surroundings are loaded and whose obstacles are inflated, or
  // kNotThere. kResourceExhausted beyond the memory limit, kInvalidData for a tile of another
  // profile, and whatever the source reports.
  Result<std::int32_t> Ready(const TileId& id);
  Status MakeReady(std::uint32_t slot);

  SurfaceTile& tile(std::uint32_t slot) { return *tiles_[slot]; }
  SurfaceNode& node(const NodeRef& ref) { return tiles_[ref.slot]->nodes[ref.node]; }

  // Cell (x, y) counted from the corner of `home`, up to one tile beyond it. Requires that `home`
  // is ready.
  CellNodes Cell(const SurfaceTile& home, std::int32_t x, std::int32_t y) const;

  // Requires that the node's tile is ready. Computed once.
  bool IsDrivable(const NodeRef& ref);
  // Metres to the nearest obstacle on the node's surface, at most options.clearance_reach_m().
  double Clearance(const SurfaceNode& node) const { return inflation_.Clearance(node); }

  std::size_t tiles_loaded() const { return tiles_.size(); }
  std::size_t memory_bytes() const { return memory_bytes_; }
  // Makes room for the search in a tile. kResourceExhausted beyond the memory limit.
  Status PrepareSearch(std::uint32_t slot);

 private:
  // A cell beside another, and what may be taken as the same surface there.
  struct SlopeSample {
    std::int32_t dx = 0;
    std::int32_t dy = 0;
    std::int32_t height_limit_mm = 0;
  };

  std::vector<SlopeSample> SlopeSamples() const;
  Result<std::int32_t> Load(const TileId& id);
  Status AddMemory(std::size_t bytes);
  // Null when there is none within the sample's limit.
  const SurfaceNode* SameSurface(const SurfaceTile& home,
                                 const SurfaceNode& node,
                                 const SlopeSample& sample) const;
  bool IsGentle(const SurfaceTile& home, const SurfaceNode& node) const;

  TileSource& source_;
  const MapProfile& profile_;
  const PlanOptions& options_;
  std::int32_t side_;
  double max_gradient_;  // metres per cell
  ObstacleInflation inflation_;
  std::vector<SlopeSample> slope_samples_;
  // By TileId::Key; kNotThere where the source has none.
  std::unordered_map<std::uint64_t, std::int32_t> slots_;
  std::vector<std::unique_ptr<SurfaceTile>> tiles_;
  std::size_t memory_bytes_ = 0;
};

}  // namespace atlas
