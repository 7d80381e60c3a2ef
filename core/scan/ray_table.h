// The rays of a virtual scan over a keyframe's grid, laid out once for all scans: which cells lie
// below each azimuth at each distance.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/grid_geometry.h"

namespace atlas {

// `rays()` azimuths around the sensor, close enough that at the grid's radius neighbours are less
// than a cell apart; `steps()` samples along each, kStepCells of a cell apart.
class RayTable {
 public:
  static constexpr float kStepCells = 0.7F;

  explicit RayTable(const GridGeometry& grid);

  const GridGeometry& grid() const { return grid_; }
  int rays() const { return rays_; }
  int steps() const { return steps_; }
  float step_m() const { return step_m_; }
  float radius_m() const { return radius_m_; }
  float ray_width_rad() const { return ray_width_rad_; }

  // Requires 0 <= azimuth < 2 pi.
  int Ray(float azimuth_rad) const {
    const int ray = static_cast<int>(azimuth_rad / ray_width_rad_);
    return ray < rays_ ? ray : rays_ - 1;
  }
  // Step s is at (s + 0.5) * step_m.
  float StepRange(int step) const { return (static_cast<float>(step) + 0.5F) * step_m_; }
  // Cells (GridGeometry::Index) below the steps of one ray.
  const std::uint32_t* Cells(int ray) const {
    return cells_.data() + static_cast<std::size_t>(ray) * static_cast<std::size_t>(steps_);
  }

 private:
  GridGeometry grid_;
  int rays_ = 0;
  int steps_ = 0;
  float step_m_ = 0.0F;
  float radius_m_ = 0.0F;
  float ray_width_rad_ = 0.0F;
  std::vector<std::uint32_t> cells_;
};

}  // namespace atlas
