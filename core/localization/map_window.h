// The part of the atlas around a vehicle, prepared for matching: columns as vertical lines with
// horizontal normals, surface layers as planes, each behind a direct grid index.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"
#include "core/tile/tile.h"

namespace atlas {

struct MapWindowOptions {
  std::uint8_t occupied_nibble = 10;  // p >= 0.61
  std::uint8_t free_nibble = 6;       // p <= 0.39: rays passed and none returned
  float line_radius_m = 0.7F;         // neighbourhood that a line's normal comes from
  float max_line_ratio = 0.35F;       // smaller over larger spread: a wall; above: a pole or a bush
  float free_side_m = 0.5F;           // before a wall's face it is free, this far from it
  float slope_baseline_m = 1.0F;      // either way, over which the ground's gradient is taken
};

// An occupied segment: where the structure around it stands, in the window's plane.
struct ColumnLine {
  Eigen::Vector2f center = Eigen::Vector2f::Zero();  // of the neighbourhood, window frame, metres
  Eigen::Vector2f normal = Eigen::Vector2f::UnitX();
  bool is_wall = false;  // only the distance along the normal counts
  // A wall of which one face was mapped: free space lies before it, along the normal, and nothing
  // is known behind it. Who sees it is before it.
  bool is_one_sided = false;

  bool CanBeSeenFrom(const Eigen::Vector2f& sensor) const {
    return !is_one_sided || normal.dot(sensor - center) > 0.0F;
  }
};

// A surface layer at a cell: z = z_m + gradient . ((x, y) - cell centre).
struct SurfacePlane {
  float z_m = 0.0F;
  Eigen::Vector2f gradient = Eigen::Vector2f::Zero();
};

// Window frame: axes of the world, origin at `origin` (world, metres), its lowest corner; floats
// are exact enough.
class MapWindow {
 public:
  // `tiles`: level-0 tiles that touch the square of `radius_m` around `center`; others are ignored.
  MapWindow(const MapProfile& profile,
            std::span<const Tile* const> tiles,
            const Eigen::Vector3d& center,
            double radius_m,
            const MapWindowOptions& options);

  const Eigen::Vector3d& origin() const { return origin_; }
  float cell_size_m() const { return cell_size_m_; }
  float segment_height_m() const { return segment_height_m_; }
  float side_m() const { return static_cast<float>(side_) * cell_size_m_; }
  std::size_t lines() const { return lines_.size(); }
  std::size_t surfaces() const { return surfaces_.size(); }

  // The line nearest to `p` (window frame) at its height, within `radius_m`; null without one.
  const ColumnLine* NearestLine(const Eigen::Vector3f& p, float radius_m) const;
  // Height above the surface layer nearest to `p`, if one is within `reach_m`, and its plane.
  const SurfacePlane* NearestSurface(const Eigen::Vector3f& p,
                                     float reach_m,
                                     float* height_m) const;
  // Whether a surface was mapped in the cell of `p`, at any height.
  bool IsMapped(const Eigen::Vector3f& p) const;
  // Whether the map says that nothing stands at `p`.
  bool IsFree(const Eigen::Vector3f& p) const;
  // Whether an occupied segment stands at `p`.
  bool IsOccupied(const Eigen::Vector3f& p) const;

  // Calls visit(cell centre, mask) for every cell with occupied segments: bit k is the one at
  // heights [k, k + 1) segment_height_m().
  template <typename Visit>
  void ForEachOccupied(Visit&& visit) const {
    ForEachOccupiedCell([&](CellRef cell, std::uint64_t mask) { visit(CellCenter(cell), mask); });
  }

 private:
  struct CellRef {
    std::int32_t x;
    std::int32_t y;
  };

  template <typename Visit>
  void ForEachOccupiedCell(Visit&& visit) const {
    for (std::int32_t y = 0; y < side_; ++y) {
      for (std::int32_t x = 0; x < side_; ++x) {
        if (const std::uint64_t mask = masks_[Index({x, y})]; mask != 0) {
          visit(CellRef{x, y}, mask);
        }
      }
    }
  }

  void AddTile(const MapProfile& profile, const Tile& tile, const MapWindowOptions& options);
  void IndexSurfaces();
  void IndexBlocks();
  void FitGradients(const MapWindowOptions& options);
  void FitLines(const MapWindowOptions& options);
  ColumnLine FitLine(CellRef cell, int segment, const MapWindowOptions& options) const;
  void FindFreeSide(int segment, const MapWindowOptions& options, ColumnLine& line) const;
  bool IsFreeAt(const Eigen::Vector2f& p, int segment) const;
  std::optional<float> SurfaceNear(CellRef cell, float z_m) const;

  CellRef CellAt(float x_m, float y_m) const;
  bool Contains(CellRef cell) const;
  std::size_t Index(CellRef cell) const;
  std::uint64_t NearMask(CellRef cell) const;
  Eigen::Vector2f CellCenter(CellRef cell) const;
  // Bit of the segment at height z in the masks; negative outside.
  int SegmentAt(float z_m) const;
  const ColumnLine& LineAt(std::size_t cell, int segment) const;

  Eigen::Vector3d origin_;
  std::int64_t first_cell_x_ = 0;  // world cell of window cell (0, 0)
  std::int64_t first_cell_y_ = 0;
  std::int32_t side_ = 0;
  float cell_size_m_ = 0.1F;
  float segment_height_m_ = 1.0F;
  float slab_m_ = 0.0F;  // what lies less than this below a surface is the slab that carries it
  std::int64_t first_segment_ = 0;  // world segment of bit 0

  std::vector<std::uint64_t> masks_;       // occupied segments, by cell
  std::vector<std::uint64_t> free_masks_;  // free ones
  // Occupied segments of a block of cells and its eight neighbours: most of what is looked for
  // stands nowhere near.
  std::vector<std::uint64_t> near_masks_;
  std::int32_t side_blocks_ = 0;
  std::vector<std::uint32_t> first_line_;  // by cell: index of its lowest occupied segment's line
  std::vector<ColumnLine> lines_;
  std::vector<std::uint32_t> surface_begin_;                       // by cell, plus one
  std::vector<SurfacePlane> surfaces_;                             // by cell, lowest first
  std::vector<std::pair<std::uint32_t, float>> pending_surfaces_;  // (cell, z) while building
};

}  // namespace atlas
