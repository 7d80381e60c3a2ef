#include "core/scan/ray_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace atlas {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

}  // namespace

RayTable::RayTable(const GridGeometry& grid) : grid_(grid) {
  const double cell_m = grid.cell_size_m();
  const double radius_m = cell_m * grid.radius_cells;
  rays_ = static_cast<int>(std::ceil(kTurn * grid.radius_cells * 1.1));
  const double step_m = cell_m * static_cast<double>(kStepCells);
  steps_ = static_cast<int>(radius_m / step_m);
  step_m_ = static_cast<float>(step_m);
  radius_m_ = static_cast<float>(radius_m);
  ray_width_rad_ = static_cast<float>(kTurn / rays_);
  cells_.reserve(static_cast<std::size_t>(rays_) * static_cast<std::size_t>(steps_));
  const auto clamp_cell = [&grid](double cell) {
    return std::clamp(static_cast<std::int32_t>(std::floor(cell)), -grid.radius_cells,
                      grid.radius_cells - 1);
  };
  for (int ray = 0; ray < rays_; ++ray) {
    const double azimuth = (ray + 0.5) * kTurn / rays_;
    const double dx = std::cos(azimuth) / cell_m;
    const double dy = std::sin(azimuth) / cell_m;
    for (int step = 0; step < steps_; ++step) {
      const double range = (step + 0.5) * step_m;
      cells_.push_back(
          static_cast<std::uint32_t>(grid.Index(clamp_cell(dx * range), clamp_cell(dy * range))));
    }
  }
}

}  // namespace atlas
