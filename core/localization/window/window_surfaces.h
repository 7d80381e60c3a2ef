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

class WindowSurfaces {
 public:
  // Surfaces by cell (WindowGrid::Index) and height in the window frame, any order. Gradients are
  // taken over `baseline_m` either way.
  WindowSurfaces(const WindowGrid& grid,
                 std::vector<std::pair<std::uint32_t, float>> surfaces,
                 float baseline_m);

  std::size_t size() const { return planes_.size(); }
  // Of one cell, lowest first as they were given.
  std::span<const SurfacePlane> Of(std::size_t cell) const {
    return std::span(planes_).subspan(begin_[cell], begin_[cell + 1] - begin_[cell]);
  }
  // Height of `p` above the surface nearest to it, if one is within `reach_m`, and its plane.
  const SurfacePlane* Nearest(const WindowGrid& grid,
                              const Eigen::Vector3f& p,
                              float reach_m,
                              float* height_m) const;

 private:
  void FitGradients(const WindowGrid& grid, float baseline_m);
  std::optional<float> Near(const WindowGrid& grid, WindowCell cell, float z_m) const;

  std::vector<std::uint32_t> begin_;  // by cell, plus one
  std::vector<SurfacePlane> planes_;  // by cell
};

}  // namespace atlas
