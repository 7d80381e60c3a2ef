// How far every node is from the nearest obstacle on its own surface.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/geometry/map_profile.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface_tile.h"

namespace atlas {

class ObstacleInflation {
 public:
  ObstacleInflation(const MapProfile& profile, const PlanOptions& options);

  // Lowers the clearance of the nodes of `tile` that lie within reach of the obstacles in the 3 x 3
  // tiles around it (row-major, itself in the middle, null where there is none).
  void Inflate(SurfaceTile& tile, const std::array<const SurfaceTile*, 9>& around) const;

  // Metres to the nearest obstacle, at most the reach.
  double Clearance(const SurfaceNode& node) const;

 private:
  // A cell within reach, and what may be the same surface there.
  struct Offset {
    std::int32_t dx = 0;
    std::int32_t dy = 0;
    std::int32_t height_limit_mm = 0;
    std::uint8_t clearance = 0;
  };

  // Heights that may belong to an obstacle's surface: no further than half-way to the surfaces
  // above and below it, so that what stands under a ramp does not close the ramp.
  struct HeightBand {
    std::int64_t altitude_mm = 0;
    std::int64_t low_mm = 0;
    std::int64_t high_mm = 0;
  };

  static HeightBand BandOf(const SurfaceTile& tile, const SurfaceNode& node);
  bool IsInside(const SurfaceTile& tile, const SurfaceNode& node) const;
  void StampDisc(SurfaceTile& tile, std::int32_t x, std::int32_t y, const HeightBand& band) const;

  double reach_m_;
  std::int32_t reach_cells_;
  std::int32_t side_;
  std::vector<Offset> offsets_;
};

}  // namespace atlas
