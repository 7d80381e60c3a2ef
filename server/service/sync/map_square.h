// Distances between an upright square of the map and a straight line from point to point; metres in
// the world frame. Without state.
#pragma once

#include <Eigen/Core>

namespace atlas {

struct MapSquare {
  Eigen::Vector2d min_m;
  Eigen::Vector2d max_m;
};

// Where a line comes nearest to a square.
struct Nearest {
  double distance_m = 0.0;  // 0: it touches it
  double part = 0.0;        // of the line, 0 to 1; the first place where it touches
};

Nearest NearestTo(const Eigen::Vector2d& from_m,
                  const Eigen::Vector2d& to_m,
                  const MapSquare& square);

// Along x and along y, between the square and the box around the line. Cheap, and in neither
// direction more than the distance of NearestTo().
inline Eigen::Vector2d GapOfBoxes(const Eigen::Vector2d& from_m,
                                  const Eigen::Vector2d& to_m,
                                  const MapSquare& square) {
  return (square.min_m - from_m.cwiseMax(to_m))
      .cwiseMax(from_m.cwiseMin(to_m) - square.max_m)
      .cwiseMax(0.0);
}

}  // namespace atlas
