// The lattice of tiles, cells and segments that a map window lies on.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "core/base/fast_floor.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

struct WindowCell {
  std::int32_t x;
  std::int32_t y;
};

// Window frame: axes of the world, origin at `origin` (world, metres), the corner of its lowest
// tile; floats are exact enough. Segments are bits of a word, 64 of them on top of each other.
// Whole level-0 tiles, here called places.
class WindowGrid {
 public:
  static constexpr int kSegments = 64;

  // Segment 0 of a window whose middle is at `z_m`.
  static std::int64_t FirstSegment(const MapProfile& profile, double z_m) {
    return static_cast<std::int64_t>(std::floor(z_m / profile.segment_height_m())) - kSegments / 2;
  }

  // The places that touch the square of `radius_m` around `center`.
  WindowGrid(const MapProfile& profile,
             const Eigen::Vector2d& center,
             double radius_m,
             std::int64_t first_segment)
      : first_place_x_(PlaceAt(center.x() - radius_m, profile)),
        first_place_y_(PlaceAt(center.y() - radius_m, profile)),
        first_segment_(first_segment),
        places_(static_cast<std::int32_t>(
            1 + std::max(PlaceAt(center.x() + radius_m, profile) - first_place_x_,
                         PlaceAt(center.y() + radius_m, profile) - first_place_y_))),
        shift_(std::countr_zero(profile.tile_cells)),
        cell_size_m_(static_cast<float>(profile.cell_size_m())),
        cells_a_m_(1.0F / cell_size_m_),
        segment_height_m_(static_cast<float>(profile.segment_height_m())),
        origin_(static_cast<double>(first_place_x_) * profile.tile_size_m(),
                static_cast<double>(first_place_y_) * profile.tile_size_m(),
                static_cast<double>(first_segment_) * profile.segment_height_m()) {}

  // Level-0 tile coordinates of the lowest place, and the world's index of segment 0.
  std::int64_t first_place_x() const { return first_place_x_; }
  std::int64_t first_place_y() const { return first_place_y_; }
  std::int64_t first_segment() const { return first_segment_; }
  std::int32_t places() const { return places_; }           // along a side
  std::int32_t place_cells() const { return 1 << shift_; }  // along a place's side
  std::int32_t side() const { return places_ << shift_; }   // cells
  std::size_t all_places() const {
    return static_cast<std::size_t>(places_) * static_cast<std::size_t>(places_);
  }
  float cell_size_m() const { return cell_size_m_; }
  float cells_a_m() const { return cells_a_m_; }
  float segment_height_m() const { return segment_height_m_; }
  const Eigen::Vector3d& origin() const { return origin_; }

  WindowCell CellAt(const Eigen::Vector2f& p) const {
    return {FastFloor(p.x() * cells_a_m_), FastFloor(p.y() * cells_a_m_)};
  }
  bool Contains(WindowCell cell) const {
    return cell.x >= 0 && cell.x < side() && cell.y >= 0 && cell.y < side();
  }
  // What takes a cell requires Contains(cell). Places are row-major, x fastest.
  std::size_t PlaceOf(WindowCell cell) const {
    return static_cast<std::size_t>(cell.y >> shift_) * static_cast<std::size_t>(places_) +
           static_cast<std::size_t>(cell.x >> shift_);
  }
  TileId IdOf(std::size_t place) const {
    const auto side = static_cast<std::size_t>(places_);
    return {0, static_cast<std::int32_t>(first_place_x_ + static_cast<std::int64_t>(place % side)),
            static_cast<std::int32_t>(first_place_y_ + static_cast<std::int64_t>(place / side))};
  }
  WindowCell InPlace(WindowCell cell) const {
    return {cell.x & (place_cells() - 1), cell.y & (place_cells() - 1)};
  }
  // A cell's lowest corner.
  Eigen::Vector2f CornerAt(WindowCell cell) const {
    return {static_cast<float>(cell.x) * cell_size_m_, static_cast<float>(cell.y) * cell_size_m_};
  }
  Eigen::Vector2f Center(WindowCell cell) const {
    return {(static_cast<float>(cell.x) + 0.5F) * cell_size_m_,
            (static_cast<float>(cell.y) + 0.5F) * cell_size_m_};
  }
  // The segment at a height; negative outside.
  int SegmentAt(float z_m) const {
    const std::int32_t segment = FastFloor(z_m / segment_height_m_);
    return segment >= 0 && segment < kSegments ? segment : -1;
  }

 private:
  static std::int64_t PlaceAt(double coordinate_m, const MapProfile& profile) {
    return static_cast<std::int64_t>(std::floor(coordinate_m / profile.tile_size_m()));
  }

  std::int64_t first_place_x_;
  std::int64_t first_place_y_;
  std::int64_t first_segment_;
  std::int32_t places_;
  int shift_;
  float cell_size_m_;
  float cells_a_m_;
  float segment_height_m_;
  Eigen::Vector3d origin_;
};

}  // namespace atlas
