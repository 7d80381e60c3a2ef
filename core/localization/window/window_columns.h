// What the columns of a map window say: occupied and free segments, and the occupied ones as
// vertical lines with horizontal normals.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/localization/window/occupied_rows.h"
#include "core/localization/window/window_grid.h"

namespace atlas {

struct ColumnLineOptions {
  float radius_m = 0.7F;     // neighbourhood that a line's normal comes from
  float max_ratio = 0.35F;   // smaller over larger spread: a wall; above: a pole or a bush
  float free_side_m = 0.5F;  // before a wall's face it is free, this far from it
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

// One word a cell, bit k its segment k (WindowGrid).
struct SegmentMasks {
  std::vector<std::uint64_t> occupied;
  std::vector<std::uint64_t> free;
};

// For one thread at a time: lines are fitted when they are first asked for.
class WindowColumns {
 public:
  WindowColumns(const WindowGrid& grid, SegmentMasks masks, const ColumnLineOptions& options);

  std::size_t lines() const { return lines_.size(); }
  const std::vector<std::uint64_t>& occupied() const { return masks_.occupied; }
  const OccupiedRows& rows() const { return rows_; }
  bool IsOccupied(std::size_t cell, int segment) const {
    return ((masks_.occupied[cell] >> segment) & 1) != 0;
  }
  bool IsFree(std::size_t cell, int segment) const {
    return ((masks_.free[cell] >> segment) & 1) != 0;
  }
  // The line nearest to `p` (window frame) at its height, within `radius_m` (OccupiedRows);
  // null without one.
  const ColumnLine* NearestLine(const WindowGrid& grid,
                                const Eigen::Vector3f& p,
                                float radius_m) const;

 private:
  ColumnLine FitLine(const WindowGrid& grid, WindowCell cell, int segment) const;
  void FindFreeSide(const WindowGrid& grid, int segment, ColumnLine& line) const;
  const ColumnLine& LineAt(const WindowGrid& grid, WindowCell cell, int segment) const;

  SegmentMasks masks_;
  OccupiedRows rows_;
  std::vector<std::uint32_t> first_line_;  // by cell: index of its lowest occupied segment's line
  // Fitted when first asked for: a scan sees few of them.
  mutable std::vector<std::optional<ColumnLine>> lines_;
  ColumnLineOptions options_;
};

}  // namespace atlas
