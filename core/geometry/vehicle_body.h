// Where the vehicle itself is, nothing else can be, and what it stands on can be driven on: the
// surest evidence there is, also against what stood or moved there.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/geometry/grid_geometry.h"

namespace atlas {

// A box around the sensor, levelled frame, from the ground to the sensor's height. Default: a car
// with its mirrors; shorter than it is, for the sensor may stand at either end.
struct VehicleBody {
  float half_length_m = 1.5F;
  float half_width_m = 1.1F;

  // Calls visit(ix, iy) for the cells of `grid` below it.
  template <typename Visit>
  void ForEachCell(const GridGeometry& grid, Visit&& visit) const {
    const std::int32_t reach_x = Reach(half_length_m, grid);
    const std::int32_t reach_y = Reach(half_width_m, grid);
    for (std::int32_t iy = -reach_y; iy < reach_y; ++iy) {
      for (std::int32_t ix = -reach_x; ix < reach_x; ++ix) {
        visit(ix, iy);
      }
    }
  }

 private:
  static std::int32_t Reach(float half_m, const GridGeometry& grid) {
    return std::min(static_cast<std::int32_t>(std::lround(half_m / grid.cell_size_m())),
                    grid.radius_cells);
  }
};

}  // namespace atlas
