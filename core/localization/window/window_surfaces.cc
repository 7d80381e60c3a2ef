#include "core/localization/window/window_surfaces.h"

#include <algorithm>
#include <cmath>

namespace atlas {

WindowSurfaces::WindowSurfaces(const WindowGrid& grid,
                               std::vector<std::pair<std::uint32_t, float>> surfaces,
                               float baseline_m) {
  std::stable_sort(surfaces.begin(), surfaces.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  begin_.assign(grid.size() + 1, 0);
  planes_.reserve(surfaces.size());
  for (const auto& [cell, z_m] : surfaces) {
    ++begin_[cell + 1];
    planes_.push_back({z_m, Eigen::Vector2f::Zero()});
  }
  for (std::size_t i = 1; i < begin_.size(); ++i) {
    begin_[i] += begin_[i - 1];
  }
  FitGradients(grid, baseline_m);
}

const SurfacePlane* WindowSurfaces::Nearest(const WindowGrid& grid,
                                            const Eigen::Vector3f& p,
                                            float reach_m,
                                            float* height_m) const {
  const WindowCell cell = grid.CellAt(p.head<2>());
  if (!grid.Contains(cell)) {
    return nullptr;
  }
  const Eigen::Vector2f offset = p.head<2>() - grid.Center(cell);
  const SurfacePlane* best = nullptr;
  for (const SurfacePlane& plane : Of(grid.Index(cell))) {
    const float height = p.z() - plane.z_m - plane.gradient.dot(offset);
    if (std::abs(height) < reach_m) {
      reach_m = std::abs(height);
      *height_m = height;
      best = &plane;
    }
  }
  return best;
}

void WindowSurfaces::FitGradients(const WindowGrid& grid, float baseline_m) {
  const std::int32_t reach =
      std::max(1, static_cast<std::int32_t>(std::lround(baseline_m / grid.cell_size_m())));
  const float span_m = 2.0F * static_cast<float>(reach) * grid.cell_size_m();
  for (std::int32_t y = 0; y < grid.side(); ++y) {
    for (std::int32_t x = 0; x < grid.side(); ++x) {
      const std::size_t index = grid.Index({x, y});
      for (std::uint32_t i = begin_[index]; i < begin_[index + 1]; ++i) {
        SurfacePlane& plane = planes_[i];
        const auto east = Near(grid, {x + reach, y}, plane.z_m);
        const auto west = Near(grid, {x - reach, y}, plane.z_m);
        const auto north = Near(grid, {x, y + reach}, plane.z_m);
        const auto south = Near(grid, {x, y - reach}, plane.z_m);
        plane.gradient.x() = east && west ? (*east - *west) / span_m : 0.0F;
        plane.gradient.y() = north && south ? (*north - *south) / span_m : 0.0F;
      }
    }
  }
}

// Of a surface of the cell that is about as high.
std::optional<float> WindowSurfaces::Near(const WindowGrid& grid,
                                          WindowCell cell,
                                          float z_m) const {
  constexpr float kReach_m = 0.3F;
  if (!grid.Contains(cell)) {
    return std::nullopt;
  }
  for (const SurfacePlane& plane : Of(grid.Index(cell))) {
    if (std::abs(plane.z_m - z_m) < kReach_m) {
      return plane.z_m;
    }
  }
  return std::nullopt;
}

}  // namespace atlas
