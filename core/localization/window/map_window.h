// The part of the atlas around a vehicle, prepared for matching: columns as vertical lines with
// horizontal normals, surface layers as planes, each behind a direct grid index. Each tile is
// prepared once, however far the window moves while it is in it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"
#include "core/localization/window/cell_kernel.h"
#include "core/localization/window/window_grid.h"
#include "core/localization/window/window_place.h"
#include "core/tile/tile.h"

namespace atlas {

// How much of a point whose place in the plane is uncertain lies in occupied segments, 0 to 1, and
// its derivatives, per metre.
struct PointPresence {
  float value = 0.0F;
  Eigen::Vector2f gradient = Eigen::Vector2f::Zero();
  float curve_xx = 0.0F;
  float curve_xy = 0.0F;
  float curve_yy = 0.0F;
};

// Points are given in the window frame (WindowGrid). For one thread at a time (WindowPlace).
class MapWindow {
 public:
  using Tiles = std::span<const std::shared_ptr<const Tile>>;

  // Nothing, around the world's origin.
  MapWindow(const MapProfile& profile, const PlaceOptions& options);

  // Makes it what `tiles` say of the square of `radius_m` around `center`; its frame may move. Of
  // tiles on top of each other the finest counts, others elsewhere are ignored. What was prepared
  // of the same tiles stays.
  void Renew(Tiles tiles, const Eigen::Vector3d& center, double radius_m);

  const Eigen::Vector3d& origin() const { return grid_.origin(); }
  float segment_height_m() const { return grid_.segment_height_m(); }
  float side_m() const { return static_cast<float>(grid_.side()) * grid_.cell_size_m(); }
  // Occupied segments, and surfaces.
  std::size_t lines() const;
  std::size_t surfaces() const;

  // The line nearest to `p` at its height, within `radius_m`; none where nothing was mapped.
  std::optional<ColumnLine> NearestLine(const Eigen::Vector3f& p, float radius_m) const;
  // The surface layer nearest to `p`, if one is within `reach_m`.
  std::optional<SurfaceBelow> NearestSurface(const Eigen::Vector3f& p, float reach_m) const;
  // Whether a surface was mapped in the cell of `p`, at any height.
  bool IsMapped(const Eigen::Vector3f& p) const;
  // The level of the tile that says so; none where IsMapped() is false.
  std::optional<int> LevelAt(const Eigen::Vector3f& p) const;
  // Whether the map says that nothing stands at `p`.
  bool IsFree(const Eigen::Vector3f& p) const;
  // Whether an occupied segment stands at `p`.
  bool IsOccupied(const Eigen::Vector3f& p) const;
  // Of a point as uncertain as `kernel` says, among the segments at its height.
  PointPresence PresenceAt(const Eigen::Vector3f& p, const CellKernel& kernel) const;

  // Calls visit(cell centre, mask) for every cell with occupied segments: bit k is the one at
  // heights [k, k + 1) segment_height_m(). Without closed gaps.
  template <typename Visit>
  void ForEachOccupied(Visit&& visit) const {
    const std::int32_t side = grid_.place_cells();
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (places_[i] == nullptr || !places_[i]->content().has_occupied()) {
        continue;
      }
      const std::span<const std::uint64_t> occupied = places_[i]->content().occupied();
      const auto column = static_cast<std::int32_t>(i) % grid_.places();
      const auto row = static_cast<std::int32_t>(i) / grid_.places();
      for (std::int32_t cell = 0; cell < side * side; ++cell) {
        if (const std::uint64_t mask = occupied[static_cast<std::size_t>(cell)]; mask != 0) {
          visit(grid_.Center({column * side + cell % side, row * side + cell / side}), mask);
        }
      }
    }
  }

 private:
  // A cell's place, null where there is none, and the cell there; `first` is the place's first.
  struct Local {
    const WindowPlace* place = nullptr;
    WindowCell cell{};
    WindowCell first{};
    std::size_t index = 0;
  };
  Local At(const Eigen::Vector2f& p) const;

  WindowGrid GridAround(const Eigen::Vector3d& center, double radius_m) const;
  std::vector<const std::shared_ptr<const Tile>*> SourcesOf(Tiles tiles) const;
  // Of the places of `before`, whose grid was another, those that stay.
  void TakeOver(const WindowGrid& before_grid, std::vector<std::unique_ptr<WindowPlace>> before);
  void ReadPlaces(const std::vector<const std::shared_ptr<const Tile>*>& sources);
  bool IsBesideOccupied(std::size_t place) const;
  WindowPlace::Nine Around(std::size_t place) const;
  std::unique_ptr<WindowPlace> Spare();

  MapProfile profile_;
  PlaceOptions options_;
  WindowGrid grid_;
  float slab_m_ = 0.0F;  // what lies less than this below a surface is the slab that carries it
  std::vector<std::unique_ptr<WindowPlace>> places_;
  std::vector<std::unique_ptr<WindowPlace>> spare_;
  std::uint64_t serial_ = 0;
  ClosedMasks scratch_;
};

}  // namespace atlas
