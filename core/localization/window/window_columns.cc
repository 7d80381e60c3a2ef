#include "core/localization/window/window_columns.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <utility>

namespace atlas {
namespace {

// Of a disc of cells, at `dy` from its middle.
std::int32_t HalfChord(std::int32_t reach, std::int32_t dy) {
  return static_cast<std::int32_t>(std::sqrt(static_cast<float>(reach * reach - dy * dy)));
}

}  // namespace

WindowColumns::WindowColumns(const WindowGrid& grid,
                             SegmentMasks masks,
                             const ColumnLineOptions& options)
    : masks_(std::move(masks)), rows_(grid, masks_.occupied), options_(options) {
  first_line_.reserve(grid.size());
  std::uint32_t lines = 0;
  for (const std::uint64_t mask : masks_.occupied) {
    first_line_.push_back(lines);
    lines += static_cast<std::uint32_t>(std::popcount(mask));
  }
  lines_.resize(lines);
}

const ColumnLine* WindowColumns::NearestLine(const WindowGrid& grid,
                                             const Eigen::Vector3f& p,
                                             float radius_m) const {
  const int segment = grid.SegmentAt(p.z());
  if (segment < 0) {
    return nullptr;
  }
  const std::optional<WindowCell> nearest = rows_.Nearest(grid, p.head<2>(), segment, radius_m);
  return nearest ? &LineAt(grid, *nearest, segment) : nullptr;
}

ColumnLine WindowColumns::FitLine(const WindowGrid& grid, WindowCell cell, int segment) const {
  const auto reach =
      std::min(static_cast<std::int32_t>(std::lround(options_.radius_m / grid.cell_size_m())),
               OccupiedRows::kMaxReach);
  float count = 0.0F;
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  Eigen::Matrix2f squares = Eigen::Matrix2f::Zero();
  for (std::int32_t dy = -reach; dy <= reach; ++dy) {
    const std::int32_t width = HalfChord(reach, dy);
    std::uint64_t row = rows_.Around({cell.x, cell.y + dy}, segment, width);
    for (; row != 0; row &= row - 1) {
      const Eigen::Vector2f offset(static_cast<float>(std::countr_zero(row) - width),
                                   static_cast<float>(dy));
      count += 1.0F;
      sum += offset;
      squares += offset * offset.transpose();
    }
  }
  const Eigen::Vector2f mean = sum / count;
  const Eigen::Matrix2f spread = squares / count - mean * mean.transpose();
  // Closed-form eigenvectors of a symmetric 2x2 matrix: half the angle of (xx - yy, 2 xy).
  const float difference = spread(0, 0) - spread(1, 1);
  const float root = std::hypot(difference, 2.0F * spread(0, 1));
  const float trace = spread.trace();
  const float angle = 0.5F * std::atan2(2.0F * spread(0, 1), difference);
  ColumnLine line;
  line.normal = {-std::sin(angle), std::cos(angle)};
  line.is_wall = count >= 3.0F && (trace - root) < options_.max_ratio * (trace + root);
  line.center = grid.Center(cell);
  if (line.is_wall) {
    line.center += grid.cell_size_m() * mean;
    FindFreeSide(grid, segment, line);
  }
  return line;
}

void WindowColumns::FindFreeSide(const WindowGrid& grid, int segment, ColumnLine& line) const {
  const auto is_free_at = [&](const Eigen::Vector2f& p) {
    const WindowCell cell = grid.CellAt(p);
    return grid.Contains(cell) && IsFree(grid.Index(cell), segment);
  };
  const Eigen::Vector2f arm = options_.free_side_m * line.normal;
  const bool is_free_before = is_free_at(line.center + arm);
  const bool is_free_behind = is_free_at(line.center - arm);
  line.is_one_sided = is_free_before != is_free_behind;
  if (line.is_one_sided && is_free_behind) {
    line.normal = -line.normal;
  }
}

const ColumnLine& WindowColumns::LineAt(const WindowGrid& grid,
                                        WindowCell cell,
                                        int segment) const {
  const std::size_t index = grid.Index(cell);
  const std::uint64_t below = masks_.occupied[index] & ((std::uint64_t{1} << segment) - 1);
  std::optional<ColumnLine>& line =
      lines_[first_line_[index] + static_cast<std::size_t>(std::popcount(below))];
  if (!line) {
    line = FitLine(grid, cell, segment);
  }
  return *line;
}

}  // namespace atlas
