#include "server/service/sync/map_square.h"

#include <algorithm>
#include <utility>

namespace atlas {
namespace {

using Eigen::Vector2d;

double Gap(const Vector2d& point_m, const MapSquare& square) {
  return (square.min_m - point_m).cwiseMax(point_m - square.max_m).cwiseMax(0.0).norm();
}

void Take(Nearest& nearest, double distance_m, double part) {
  if (distance_m < nearest.distance_m) {
    nearest = {distance_m, part};
  }
}

// The parts of the line within both slabs; the first is above the second if there are none.
std::pair<double, double> PartInside(const Vector2d& from_m,
                                     const Vector2d& step_m,
                                     const MapSquare& square) {
  double enter = 0.0;
  double leave = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    if (step_m[axis] == 0.0) {
      if (from_m[axis] < square.min_m[axis] || from_m[axis] > square.max_m[axis]) {
        enter = 2.0;
      }
      continue;
    }
    const double a = (square.min_m[axis] - from_m[axis]) / step_m[axis];
    const double b = (square.max_m[axis] - from_m[axis]) / step_m[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return {enter, leave};
}

}  // namespace

Nearest NearestTo(const Vector2d& from_m, const Vector2d& to_m, const MapSquare& square) {
  Nearest nearest{Gap(from_m, square), 0.0};
  const Vector2d step_m = to_m - from_m;
  const double squared = step_m.squaredNorm();
  if (squared == 0.0 || nearest.distance_m == 0.0) {
    return nearest;
  }
  const auto [enter, leave] = PartInside(from_m, step_m, square);
  if (enter <= leave) {
    return {0.0, enter};
  }
  Take(nearest, Gap(to_m, square), 1.0);
  for (const Vector2d& corner : {square.min_m, Vector2d(square.max_m.x(), square.min_m.y()),
                                 Vector2d(square.min_m.x(), square.max_m.y()), square.max_m}) {
    const double part = std::clamp((corner - from_m).dot(step_m) / squared, 0.0, 1.0);
    Take(nearest, (from_m + part * step_m - corner).norm(), part);
  }
  return nearest;
}

}  // namespace atlas
