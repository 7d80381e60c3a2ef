// The finest level as a vehicle finds it: the answer to "may its middle be here?", and what driving
// there costs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "core/planning/plan_budget.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface/obstacle_clearance.h"
#include "core/planning/surface/surface_tiles.h"

namespace atlas {

class SurfaceMap {
 public:
  // All outlive the map. Requires options.Validate(profile).ok().
  SurfaceMap(TileSource& source,
             const MapProfile& profile,
             const PlanOptions& options,
             PlanBudget& budget);

  SurfaceTiles& tiles() { return tiles_; }
  const SurfaceTiles& tiles() const { return tiles_; }

  // How searches move (grid_search.h): so many cells at most, over a hole that may be crossed; no
  // higher step; layers this near in height belong to the surface driven on, even where it cannot
  // be driven.
  std::int32_t max_cells() const { return max_cells_; }
  std::int32_t max_step_mm() const { return max_step_mm_; }
  static constexpr std::int32_t kSameSurface_mm = 1'000;

  // Makes the node's kDrivable and `clearance` known. Errors as of SurfaceTiles::Load.
  Status Analyse(const NodeRef& ref);
  // What a metre that ends here costs, from 1 on. Requires that the node is analysed.
  float CostOfMetre(const NodeRef& ref) const { return cost_of_metre_[tiles_.node(ref).clearance]; }
  // Metres to the nearest obstacle on the node's surface, at most options.clearance_reach_m().
  // Requires that the node is analysed.
  double ClearanceMetres(const NodeRef& ref) const {
    return clearance_.Metres(tiles_.node(ref).clearance);
  }
  // Of the plane fitted around the node, rise over run; none where the surface ends. Requires that
  // the node is analysed.
  std::optional<double> Slope(const NodeRef& ref) const;

 private:
  // A cell beside another, and what may be taken as the same surface there.
  struct SlopeSample {
    std::int32_t dx = 0;
    std::int32_t dy = 0;
    std::int32_t height_limit_mm = 0;
  };

  void FillCosts();
  void FillSlopeSamples();
  void Judge(const NodeRef& ref);
  std::optional<double> Gradient(const SurfaceTile& home, const SurfaceNode& node) const;

  const PlanOptions& options_;
  SurfaceTiles tiles_;
  ObstacleClearance clearance_;
  std::int32_t max_cells_;
  std::int32_t max_step_mm_;
  double max_gradient_;  // metres per cell
  std::array<float, 256> cost_of_metre_{};
  std::vector<SlopeSample> slope_samples_;
};

}  // namespace atlas
