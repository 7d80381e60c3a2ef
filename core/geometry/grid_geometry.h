// The square grid around a sensor that a keyframe is made of.
#pragma once

#include <cstdint>

namespace atlas {

// `side() x side()` cells, the sensor on the corner between the four middle ones: cell (ix, iy)
// with -radius_cells <= ix, iy < radius_cells covers [ix, ix+1) x [iy, iy+1) cell sizes of the
// gravity-levelled frame. Row-major, x fastest.
struct GridGeometry {
  std::uint32_t cell_size_um = 100'000;
  std::int32_t radius_cells = 200;

  std::int32_t side() const { return 2 * radius_cells; }
  std::size_t size() const {
    return static_cast<std::size_t>(side()) * static_cast<std::size_t>(side());
  }
  double cell_size_m() const { return cell_size_um * 1e-6; }
  bool Contains(std::int32_t ix, std::int32_t iy) const {
    return ix >= -radius_cells && ix < radius_cells && iy >= -radius_cells && iy < radius_cells;
  }
  // Requires Contains(ix, iy).
  std::size_t Index(std::int32_t ix, std::int32_t iy) const {
    return static_cast<std::size_t>(iy + radius_cells) * static_cast<std::size_t>(side()) +
           static_cast<std::size_t>(ix + radius_cells);
  }

  friend bool operator==(const GridGeometry&, const GridGeometry&) = default;
};

}  // namespace atlas
