// A coarser level, optimistically: where a vehicle's middle may be at all, and the least that
// driving there may cost. What lies between its cells' middles is never cheaper on the finest
// level, but for what a cell rounds (docs/algorithms/planning.md).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "core/planning/plan_budget.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface/surface_map.h"
#include "core/planning/surface/surface_tiles.h"

namespace atlas {

class CoarseMap {
 public:
  // All outlive the map. Requires options.Validate(profile).ok() and level > 0.
  CoarseMap(TileSource& source,
            const MapProfile& profile,
            const PlanOptions& options,
            PlanBudget& budget,
            std::uint8_t level);

  // From now on nodes are drivable only where one of the finest level is. The map outlives this.
  void CheckWith(SurfaceMap& finest) { finest_ = &finest; }

  SurfaceTiles& tiles() { return tiles_; }
  const SurfaceTiles& tiles() const { return tiles_; }

  // As of SurfaceMap. Layers of this level lie between those that they are made of, so steps are
  // higher.
  std::int32_t max_cells() const { return max_cells_; }
  std::int32_t max_step_mm() const { return max_step_mm_; }
  static constexpr std::int32_t kSameSurface_mm = 2'000;

  // Makes the node's kDrivable and `clearance` known. Errors as of SurfaceTiles::Load.
  Status Analyse(const NodeRef& ref);
  // What a metre that ends here costs at least. Requires that the node is analysed.
  float CostOfMetre(const NodeRef& ref) const { return costs_[tiles_.node(ref).clearance]; }

  // The drivable node that a node of a finer level belongs to, or one beside it; none where there
  // is none. Errors as of SurfaceTiles::Load.
  Result<NodeRef> Above(const SurfaceTiles& finer, const NodeRef& ref);

 private:
  static constexpr std::uint8_t kFarCost = 255;

  // A cell beside another: an obstacle in it is no farther from whatever lies in the other than
  // this.
  struct Offset {
    std::int32_t dx = 0;
    std::int32_t dy = 0;
    double farthest_m = 0.0;
    bool closes = false;
    std::uint8_t cost = 0;  // in costs_
  };

  void FillCosts();
  // In costs_, what a metre costs at least where no obstacle is farther than this.
  std::uint8_t CostAt(double clearance_m) const;
  void FillOffsets(const MapProfile& profile);
  void Judge(const SurfaceTile& home, SurfaceNode& node) const;
  bool IsObstacle(const SurfaceTile& home, const SurfaceNode& node, const Offset& offset) const;

  // Where a node of the finest level can be driven on, and how far from an obstacle whatever lies
  // in the node's cell may be; none where there is none.
  Result<std::optional<double>> FarthestBelow(const NodeRef& ref);

  SurfaceTiles tiles_;
  SurfaceMap* finest_ = nullptr;
  std::int32_t max_cells_;
  std::int32_t max_step_mm_;
  PlanOptions options_;
  std::vector<Offset> offsets_;            // nearest first
  std::array<float, kFarCost + 1> costs_;  // of a metre: falling, the last one without obstacles
};

}  // namespace atlas
