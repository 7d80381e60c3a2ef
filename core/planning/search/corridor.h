// Where a route may lead, and what is left to the goal from there, as two coarser levels know it:
// streets first, then what of them a vehicle may drive on.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/planning/coarse/coarse_map.h"
#include "core/planning/plan_budget.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface/surface_map.h"
#include "core/planning/tile_source.h"

namespace atlas {

class Corridor {
 public:
  // How much dearer than the coarse level's cheapest way others may be that still belong to it.
  struct Width {
    float factor = 1.0F;
    float metres = 0.0F;
  };

  // All outlive the corridor.
  Corridor(TileSource& source,
           const MapProfile& profile,
           const PlanOptions& options,
           PlanBudget& budget,
           SurfaceMap& map);

  // Marks the nodes of tiles() that a finer search may go along (SurfaceNode::kCorridor), with what
  // is left from them to the goal as their cost, at most `leaning` times the least: the higher, the
  // fewer are marked. What the cheapest route inside of it costs, to the same; none where there is
  // no corridor, whatever the leaning. Errors as of PlanBudget and of the tile source.
  Result<std::optional<double>> Find(const NodeRef& start,
                                     const NodeRef& goal,
                                     const Width& width,
                                     float leaning);

  // Both ends were found on the coarse level: there is a pyramid to find corridors in.
  bool has_coarse_ends() const { return has_coarse_ends_; }

  const SurfaceTiles& tiles() const { return middle_->tiles(); }

 private:
  Result<bool> FindStreets(const NodeRef& start, const NodeRef& goal, const Width& width);
  Result<std::optional<double>> FindLanes(const NodeRef& start, const NodeRef& goal, float leaning);

  PlanBudget& budget_;
  SurfaceMap& map_;
  // None where the pyramid has too few levels.
  std::optional<CoarseMap> coarse_;
  std::optional<CoarseMap> middle_;
  bool has_coarse_ends_ = false;
};

}  // namespace atlas
