#include "core/localization/window/window_surfaces.h"

#include <algorithm>
#include <cmath>

namespace atlas {

WindowSurfaces::WindowSurfaces(const WindowGrid& grid,
                               std::span<const std::pair<std::uint32_t, float>> surfaces,
                               float baseline_m)
    : begin_(grid.size() + 1, 0),
      heights_m_(surfaces.size()),
      baseline_cells_(
          std::max(1, static_cast<std::int32_t>(std::lround(baseline_m / grid.cell_size_m())))) {
  for (const auto& [cell, z_m] : surfaces) {
    ++begin_[cell + 1];
  }
  for (std::size_t i = 1; i < begin_.size(); ++i) {
    begin_[i] += begin_[i - 1];
  }
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (const auto& [cell, z_m] : surfaces) {
    heights_m_[next[cell]++] = z_m;
  }
}

std::optional<SurfaceBelow> WindowSurfaces::Nearest(const WindowGrid& grid,
                                                    const Eigen::Vector3f& p,
                                                    float reach_m) const {
  const WindowCell cell = grid.CellAt(p.head<2>());
  if (!grid.Contains(cell)) {
    return std::nullopt;
  }
  const Eigen::Vector2f offset = p.head<2>() - grid.Center(cell);
  std::optional<SurfaceBelow> nearest;
  for (const float z_m : Of(grid.Index(cell))) {
    // No slope carries a surface further than this within its cell.
    if (std::abs(p.z() - z_m) > reach_m + 2.0F * grid.cell_size_m()) {
      continue;
    }
    const SurfacePlane plane{z_m, GradientAt(grid, cell, z_m)};
    const float height_m = p.z() - z_m - plane.gradient.dot(offset);
    if (std::abs(height_m) < reach_m) {
      reach_m = std::abs(height_m);
      nearest = {plane, height_m};
    }
  }
  return nearest;
}

Eigen::Vector2f WindowSurfaces::GradientAt(const WindowGrid& grid,
                                           WindowCell cell,
                                           float z_m) const {
  const std::int32_t reach = baseline_cells_;
  const float span_m = 2.0F * static_cast<float>(reach) * grid.cell_size_m();
  const auto east = Near(grid, {cell.x + reach, cell.y}, z_m);
  const auto west = Near(grid, {cell.x - reach, cell.y}, z_m);
  const auto north = Near(grid, {cell.x, cell.y + reach}, z_m);
  const auto south = Near(grid, {cell.x, cell.y - reach}, z_m);
  return {east && west ? (*east - *west) / span_m : 0.0F,
          north && south ? (*north - *south) / span_m : 0.0F};
}

// Of a surface of the cell that is about as high.
std::optional<float> WindowSurfaces::Near(const WindowGrid& grid,
                                          WindowCell cell,
                                          float z_m) const {
  constexpr float kReach_m = 0.3F;
  if (!grid.Contains(cell)) {
    return std::nullopt;
  }
  for (const float other_m : Of(grid.Index(cell))) {
    if (std::abs(other_m - z_m) < kReach_m) {
      return other_m;
    }
  }
  return std::nullopt;
}

}  // namespace atlas
