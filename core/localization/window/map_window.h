// The part of the atlas around a vehicle, prepared for matching: columns as vertical lines with
// horizontal normals, surface layers as planes, each behind a direct grid index.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"
#include "core/localization/window/cell_kernel.h"
#include "core/localization/window/window_columns.h"
#include "core/localization/window/window_grid.h"
#include "core/localization/window/window_surfaces.h"
#include "core/tile/tile.h"

namespace atlas {

struct MapWindowOptions {
  std::uint8_t occupied_nibble = 10;  // p >= 0.61
  std::uint8_t free_nibble = 6;       // p <= 0.39: rays passed and none returned
  ColumnLineOptions lines;
  float slope_baseline_m = 1.0F;  // either way, over which the ground's gradient is taken
};

// How much of a point whose place in the plane is uncertain lies in occupied segments, 0 to 1, and
// its derivatives, per metre.
struct PointPresence {
  float value = 0.0F;
  Eigen::Vector2f gradient = Eigen::Vector2f::Zero();
  float curve_xx = 0.0F;
  float curve_xy = 0.0F;
  float curve_yy = 0.0F;
};

// Points are given in the window frame (WindowGrid). For one thread at a time (WindowColumns).
class MapWindow {
 public:
  // `tiles`: level-0 tiles that touch the square of `radius_m` around `center`; others are ignored.
  MapWindow(const MapProfile& profile,
            std::span<const Tile* const> tiles,
            const Eigen::Vector3d& center,
            double radius_m,
            const MapWindowOptions& options);

  const Eigen::Vector3d& origin() const { return grid_.origin(); }
  float cell_size_m() const { return grid_.cell_size_m(); }
  float segment_height_m() const { return grid_.segment_height_m(); }
  float side_m() const { return static_cast<float>(grid_.side()) * grid_.cell_size_m(); }
  std::size_t lines() const { return columns_.lines(); }
  std::size_t surfaces() const { return surfaces_.size(); }

  // The line nearest to `p` at its height, within `radius_m`; null without one.
  const ColumnLine* NearestLine(const Eigen::Vector3f& p, float radius_m) const {
    return columns_.NearestLine(grid_, p, radius_m);
  }
  // The surface layer nearest to `p`, if one is within `reach_m`.
  std::optional<SurfaceBelow> NearestSurface(const Eigen::Vector3f& p, float reach_m) const {
    return surfaces_.Nearest(grid_, p, reach_m);
  }
  // Whether a surface was mapped in the cell of `p`, at any height.
  bool IsMapped(const Eigen::Vector3f& p) const;
  // Whether the map says that nothing stands at `p`.
  bool IsFree(const Eigen::Vector3f& p) const;
  // Whether an occupied segment stands at `p`.
  bool IsOccupied(const Eigen::Vector3f& p) const;
  // Of a point as uncertain as `kernel` says, among the segments at its height; none at the
  // window's edge.
  PointPresence PresenceAt(const Eigen::Vector3f& p, const CellKernel& kernel) const;

  // Calls visit(cell centre, mask) for every cell with occupied segments: bit k is the one at
  // heights [k, k + 1) segment_height_m().
  template <typename Visit>
  void ForEachOccupied(Visit&& visit) const {
    for (std::int32_t y = 0; y < grid_.side(); ++y) {
      for (std::int32_t x = 0; x < grid_.side(); ++x) {
        if (const std::uint64_t mask = columns_.occupied()[grid_.Index({x, y})]; mask != 0) {
          visit(grid_.Center({x, y}), mask);
        }
      }
    }
  }

 private:
  struct Content;
  static Content Collect(const WindowGrid& grid,
                         const MapProfile& profile,
                         std::span<const Tile* const> tiles,
                         const MapWindowOptions& options);
  MapWindow(const MapProfile& profile,
            const WindowGrid& grid,
            Content content,
            const MapWindowOptions& options);

  WindowGrid grid_;
  float slab_m_ = 0.0F;  // what lies less than this below a surface is the slab that carries it
  WindowColumns columns_;
  WindowSurfaces surfaces_;
};

}  // namespace atlas
