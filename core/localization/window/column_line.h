// Occupied column segments as vertical lines with horizontal normals.
#pragma once

#include <Eigen/Core>

namespace atlas {

struct ColumnLineOptions {
  float radius_m = 0.7F;     // neighbourhood that a line's normal comes from
  float max_ratio = 0.35F;   // smaller over larger spread: a wall; above: a pole or a bush
  float free_side_m = 0.5F;  // before a wall's face it is free, this far from it
};

// An occupied segment: where the structure around it stands, in a plane.
struct ColumnLine {
  Eigen::Vector2f center = Eigen::Vector2f::Zero();  // of the neighbourhood, metres
  Eigen::Vector2f normal = Eigen::Vector2f::UnitX();
  bool is_wall = false;  // only the distance along the normal counts
  // A wall of which one face was mapped: free space lies before it, along the normal, and nothing
  // is known behind it. Who sees it is before it.
  bool is_one_sided = false;

  bool CanBeSeenFrom(const Eigen::Vector2f& sensor) const {
    return !is_one_sided || normal.dot(sensor - center) > 0.0F;
  }
};

}  // namespace atlas
