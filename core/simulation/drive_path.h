// A line that a vehicle follows: straights and turns, drawn one after the other like a pen.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace atlas {

struct PathPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // on the surface, world frame
  double yaw_rad = 0.0;                                // of the tangent, not wrapped
};

class DrivePath {
 public:
  explicit DrivePath(const PathPoint& start) : points_{start}, along_m_{0.0} {}

  // Straight from point to point; points nearer than 0.1 m to the one before are left out. Requires
  // a point. A path of one point looks along x.
  static DrivePath Through(std::span<const Eigen::Vector3d> points);

  // `length_m` in plan, climbing `rise_m` evenly.
  DrivePath& Straight(double length_m, double rise_m = 0.0);
  // On one level; positive angles turn left.
  DrivePath& Turn(double radius_m, double angle_rad);

  // In plan, along the centre.
  double length_m() const { return along_m_.back(); }
  // The point `along_m` (clamped to the ends) from the start, moved `left_m` across; z is the
  // centre's.
  PathPoint At(double along_m, double left_m = 0.0) const;
  DrivePath Reversed() const;

 private:
  void Add(const PathPoint& point);

  std::vector<PathPoint> points_;
  std::vector<double> along_m_;
};

}  // namespace atlas
