// The surface layers of a map window as planes, by cell.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/localization/window/window_grid.h"

namespace atlas {

// A surface layer at a cell: z = z_m + gradient . ((x, y) - cell centre).
struct SurfacePlane {
  float z_m = 0.0F;
  Eigen::Vector2f gradient = Eigen::Vector2f::Zero();
};

// Where a point is over a surface.
struct SurfaceBelow {
  SurfacePlane plane;
  float height_m = 0.0F;  // of the point above it
};

class WindowSurfaces {
 public:
  // Surfaces by cell (WindowGrid::Index) and height in the window frame, any order. Gradients are
  // taken over `baseline_m` either way.
  WindowSurfaces(const WindowGrid& grid,
                 std::span<const std::pair<std::uint32_t, float>> surfaces,
                 float baseline_m);

  std::size_t size() const { return heights_m_.size(); }
  // Heights of one cell's, in the order in which they were given.
  std::span<const float> Of(std::size_t cell) const {
    return std::span(heights_m_).subspan(begin_[cell], begin_[cell + 1] - begin_[cell]);
  }
  // The surface nearest to `p`, if one is within `reach_m`.
  std::optional<SurfaceBelow> Nearest(const WindowGrid& grid,
                                      const Eigen::Vector3f& p,
                                      float reach_m) const;

 private:
  Eigen::Vector2f GradientAt(const WindowGrid& grid, WindowCell cell, float z_m) const;
  std::optional<float> Near(const WindowGrid& grid, WindowCell cell, float z_m) const;

  std::vector<std::uint32_t> begin_;  // by cell, plus one
  std::vector<float> heights_m_;      // by cell
  std::int32_t baseline_cells_;
};

}  // namespace atlas
