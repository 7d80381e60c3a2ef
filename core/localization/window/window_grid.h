// The lattice of cells and segments that a map window lies on.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"

namespace atlas {

struct WindowCell {
  std::int32_t x;
  std::int32_t y;
};

// Window frame: axes of the world, origin at `origin` (world, metres), its lowest corner; floats
// are exact enough. Segments are bits of a word, 64 of them on top of each other.
class WindowGrid {
 public:
  static constexpr int kSegments = 64;

  // The square of `radius_m` around `center`, on the map's lattice.
  WindowGrid(const MapProfile& profile, const Eigen::Vector3d& center, double radius_m)
      : first_x_(
            static_cast<std::int64_t>(std::floor((center.x() - radius_m) / profile.cell_size_m()))),
        first_y_(
            static_cast<std::int64_t>(std::floor((center.y() - radius_m) / profile.cell_size_m()))),
        first_segment_(
            static_cast<std::int64_t>(std::floor(center.z() / profile.segment_height_m())) -
            kSegments / 2),
        side_(static_cast<std::int32_t>(std::ceil(2.0 * radius_m / profile.cell_size_m())) + 1),
        cell_size_m_(static_cast<float>(profile.cell_size_m())),
        segment_height_m_(static_cast<float>(profile.segment_height_m())),
        origin_(static_cast<double>(first_x_) * profile.cell_size_m(),
                static_cast<double>(first_y_) * profile.cell_size_m(),
                static_cast<double>(first_segment_) * profile.segment_height_m()) {}

  // World indices of cell (0, 0) and of segment 0.
  std::int64_t first_x() const { return first_x_; }
  std::int64_t first_y() const { return first_y_; }
  std::int64_t first_segment() const { return first_segment_; }
  std::int32_t side() const { return side_; }  // cells
  std::size_t size() const {
    return static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_);
  }
  float cell_size_m() const { return cell_size_m_; }
  float segment_height_m() const { return segment_height_m_; }
  const Eigen::Vector3d& origin() const { return origin_; }

  WindowCell CellAt(const Eigen::Vector2f& p) const {
    return {static_cast<std::int32_t>(std::floor(p.x() / cell_size_m_)),
            static_cast<std::int32_t>(std::floor(p.y() / cell_size_m_))};
  }
  bool Contains(WindowCell cell) const {
    return cell.x >= 0 && cell.x < side_ && cell.y >= 0 && cell.y < side_;
  }
  // Requires Contains(cell). Row-major, x fastest.
  std::size_t Index(WindowCell cell) const {
    return static_cast<std::size_t>(cell.y) * static_cast<std::size_t>(side_) +
           static_cast<std::size_t>(cell.x);
  }
  Eigen::Vector2f Center(WindowCell cell) const {
    return {(static_cast<float>(cell.x) + 0.5F) * cell_size_m_,
            (static_cast<float>(cell.y) + 0.5F) * cell_size_m_};
  }
  // The segment at a height; negative outside.
  int SegmentAt(float z_m) const {
    const int segment = static_cast<int>(std::floor(z_m / segment_height_m_));
    return segment >= 0 && segment < kSegments ? segment : -1;
  }

 private:
  std::int64_t first_x_;
  std::int64_t first_y_;
  std::int64_t first_segment_;
  std::int32_t side_;
  float cell_size_m_;
  float segment_height_m_;
  Eigen::Vector3d origin_;
};

}  // namespace atlas
