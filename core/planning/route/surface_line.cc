// Every cell that the line crosses, in order.
#include "core/planning/route/surface_line.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace atlas {
namespace {

// Steps from cell to cell along a line between two cells' middles, in cells.
class CellWalk {
 public:
  CellWalk(std::int64_t dx, std::int64_t dy)
      : step_x_(dx < 0 ? -1 : 1),
        step_y_(dy < 0 ? -1 : 1),
        share_x_(dx == 0 ? kNever : 1.0 / static_cast<double>(std::abs(dx))),
        share_y_(dy == 0 ? kNever : 1.0 / static_cast<double>(std::abs(dy))),
        next_x_(0.5 * share_x_),
        next_y_(0.5 * share_y_) {}

  // Of the line, where it leaves the cell.
  double end() const { return std::min({next_x_, next_y_, 1.0}); }
  // Through a corner into the cell across.
  void Step() {
    const double at = end();
    if (next_x_ <= at + kCorner) {
      x_ += step_x_;
      next_x_ += share_x_;
    }
    if (next_y_ <= at + kCorner) {
      y_ += step_y_;
      next_y_ += share_y_;
    }
  }
  std::int64_t x() const { return x_; }
  std::int64_t y() const { return y_; }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  static constexpr double kCorner = 1e-9;

  std::int64_t x_ = 0;
  std::int64_t y_ = 0;
  std::int64_t step_x_;
  std::int64_t step_y_;
  double share_x_;
  double share_y_;
  double next_x_;
  double next_y_;
};

// A cell within reach of a node that is joined.
CellNodes CellAt(const SurfaceTiles& tiles, const NodeRef& from, std::int64_t x, std::int64_t y) {
  const SurfaceTile& home = tiles.tile(from.slot);
  return tiles.Cell(home, static_cast<std::int32_t>(x - home.origin_x),
                    static_cast<std::int32_t>(y - home.origin_y));
}

}  // namespace

Eigen::Vector3d PositionOf(const SurfaceTiles& tiles, const NodeRef& ref) {
  const auto middle_m = [&](std::int64_t cell) {
    return (static_cast<double>(cell) + 0.5) * tiles.cell_m();
  };
  return {middle_m(tiles.CellX(ref)), middle_m(tiles.CellY(ref)),
          1e-3 * tiles.node(ref).altitude_mm};
}

Result<std::optional<SurfaceLine>> FollowLine(SurfaceMap& map,
                                              const NodeRef& from,
                                              const NodeRef& to,
                                              double max_cost) {
  SurfaceTiles& tiles = map.tiles();
  const std::int64_t x = tiles.CellX(from);
  const std::int64_t y = tiles.CellY(from);
  const Eigen::Vector3d begin = PositionOf(tiles, from);
  const Eigen::Vector3d ahead = PositionOf(tiles, to) - begin;
  SurfaceLine line;
  line.points.push_back({from, begin});
  CellWalk walk(tiles.CellX(to) - x, tiles.CellY(to) - y);
  std::int32_t hole = 0;
  while (walk.end() < 1.0) {
    const double entered = walk.end();
    walk.Step();
    const NodeRef last = line.points.back().node;
    const std::int32_t altitude_mm = tiles.node(last).altitude_mm;
    const NodeRef node = tiles.Nearest(CellAt(tiles, last, x + walk.x(), y + walk.y()), altitude_mm,
                                       SurfaceMap::kSameSurface_mm);
    if (node.is_none()) {
      if (++hole >= map.max_cells()) {
        return std::nullopt;
      }
      continue;
    }
    hole = 0;
    if (Status status = map.Analyse(node); !status.ok()) {
      return Error(std::move(status));
    }
    const SurfaceNode& there = tiles.node(node);
    if (!there.Has(SurfaceNode::kDrivable) ||
        std::abs(there.altitude_mm - altitude_mm) > map.max_step_mm()) {
      return std::nullopt;
    }
    const double share = walk.end() < 1.0 ? 0.5 * (entered + walk.end()) : 1.0;
    Eigen::Vector3d position = begin + share * ahead;
    position.z() = 1e-3 * there.altitude_mm;
    line.cost += (position - line.points.back().position).norm() *
                 static_cast<double>(map.CostOfMetre(node));
    if (line.cost > max_cost) {
      return std::nullopt;
    }
    line.points.push_back({node, position});
  }
  return line.points.back().node == to ? std::optional(std::move(line)) : std::nullopt;
}

}  // namespace atlas
