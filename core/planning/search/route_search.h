// The cheapest way over the finest level: first a corridor over two coarser ones, then inside of
// it; over everything where that finds none.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/planning/plan_budget.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface/surface_map.h"
#include "core/planning/tile_source.h"

namespace atlas {

class Corridor;

class RouteSearch {
 public:
  // All outlive the search.
  RouteSearch(TileSource& source,
              const MapProfile& profile,
              const PlanOptions& options,
              PlanBudget& budget,
              SurfaceMap& map)
      : source_(source), profile_(profile), options_(options), budget_(budget), map_(map) {}

  // A way from `start` to `goal`, both included, hardly dearer than the cheapest one
  // (docs/results.md); empty when there is none. Errors as of PlanBudget and of the tile source.
  Result<std::vector<NodeRef>> Run(const NodeRef& start, const NodeRef& goal);

 private:
  Result<std::vector<NodeRef>> Guided(Corridor& corridor,
                                      const NodeRef& start,
                                      const NodeRef& goal);
  Result<std::vector<NodeRef>> Everywhere(const NodeRef& start, const NodeRef& goal);

  TileSource& source_;
  const MapProfile& profile_;
  const PlanOptions& options_;
  PlanBudget& budget_;
  SurfaceMap& map_;
};

}  // namespace atlas
