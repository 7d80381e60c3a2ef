#include "client/vehicle/area_touch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

namespace atlas {
namespace {

using Eigen::Vector2d;

struct Square {
  Vector2d low_m;
  Vector2d high_m;

  Square(const TileId& id, const MapProfile& profile) {
    const double side_m = std::ldexp(profile.tile_size_m(), id.level);
    low_m = side_m * Vector2d(id.x, id.y);
    high_m = low_m.array() + side_m;
  }

  double DistanceTo(const Vector2d& point_m) const {
    return (point_m.cwiseMax(low_m).cwiseMin(high_m) - point_m).norm();
  }
  std::array<Vector2d, 4> Corners() const {
    return {low_m, Vector2d(high_m.x(), low_m.y()), Vector2d(low_m.x(), high_m.y()), high_m};
  }
};

double DistanceToSegment(const Vector2d& point_m, const Vector2d& from_m, const Vector2d& to_m) {
  const Vector2d step_m = to_m - from_m;
  const double squared = step_m.squaredNorm();
  const double part =
      squared == 0.0 ? 0.0 : std::clamp((point_m - from_m).dot(step_m) / squared, 0.0, 1.0);
  return (from_m + part * step_m - point_m).norm();
}

// Whether the segment has a point in the square: one that lies between both pairs of its sides.
bool Crosses(const Vector2d& from_m, const Vector2d& to_m, const Square& square) {
  double enter = 0.0;
  double leave = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double step_m = to_m[axis] - from_m[axis];
    const double low_m = square.low_m[axis] - from_m[axis];
    const double high_m = square.high_m[axis] - from_m[axis];
    if (step_m == 0.0) {
      if (low_m > 0.0 || high_m < 0.0) return false;
      continue;
    }
    enter = std::max(enter, std::min(low_m / step_m, high_m / step_m));
    leave = std::min(leave, std::max(low_m / step_m, high_m / step_m));
  }
  return enter <= leave;
}

bool IsWithin(double reach_m, const Vector2d& from_m, const Vector2d& to_m, const Square& square) {
  if (Crosses(from_m, to_m, square)) return true;
  if (std::min(square.DistanceTo(from_m), square.DistanceTo(to_m)) <= reach_m) return true;
  const auto corners = square.Corners();
  return std::any_of(corners.begin(), corners.end(), [&](const Vector2d& corner_m) {
    return DistanceToSegment(corner_m, from_m, to_m) <= reach_m;
  });
}

bool IsTouched(const DiscArea& disc, const TileId&, const Square& square) {
  return square.DistanceTo(disc.center_m) <= disc.radius_m;
}

bool IsTouched(const BoxArea& box, const TileId&, const Square& square) {
  return (square.low_m.array() <= box.max_m.array()).all() &&
         (square.high_m.array() >= box.min_m.array()).all();
}

bool IsTouched(const CorridorArea& corridor, const TileId&, const Square& square) {
  const auto& route_m = corridor.route_m;
  for (std::size_t i = 0; i < route_m.size(); ++i) {
    const Vector2d& next_m = route_m[std::min(i + 1, route_m.size() - 1)];
    if (IsWithin(corridor.half_width_m, route_m[i], next_m, square)) return true;
  }
  return false;
}

bool IsTouched(const TilesArea& tiles, const TileId& id, const Square&) {
  return std::find(tiles.ids.begin(), tiles.ids.end(), id) != tiles.ids.end();
}

}  // namespace

bool Touches(const DiscArea& disc, const TileId& id, const MapProfile& profile) {
  return IsTouched(disc, id, Square(id, profile));
}

bool Touches(const MapArea& area, const TileId& id, const MapProfile& profile) {
  const Square square(id, profile);
  return std::visit([&](const auto& shape) { return IsTouched(shape, id, square); }, area);
}

}  // namespace atlas
