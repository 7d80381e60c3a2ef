// Sampling the path's pieces and reading between the samples.
#include "core/simulation/drive_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace atlas {
namespace {

constexpr double kSample_m = 0.25;

}  // namespace

void DrivePath::Add(const PathPoint& point) {
  const double step_m = (point.position - points_.back().position).head<2>().norm();
  along_m_.push_back(along_m_.back() + step_m);
  points_.push_back(point);
}

DrivePath DrivePath::Through(std::span<const Eigen::Vector3d> points) {
  constexpr double kNear_m = 0.1;
  DrivePath path({points.front(), 0.0});
  for (const Eigen::Vector3d& point : points) {
    PathPoint& last = path.points_.back();
    const Eigen::Vector2d step = (point - last.position).head<2>();
    if (step.norm() < kNear_m) {
      continue;
    }
    const double turn_rad =
        std::remainder(std::atan2(step.y(), step.x()) - last.yaw_rad, 2.0 * std::numbers::pi);
    const bool is_first = path.points_.size() == 1;
    // A corner looks half-way between its two sides.
    const double yaw_rad = last.yaw_rad + turn_rad;
    last.yaw_rad += is_first ? turn_rad : 0.5 * turn_rad;
    path.Add({point, yaw_rad});
  }
  return path;
}

DrivePath& DrivePath::Straight(double length_m, double rise_m) {
  const PathPoint start = points_.back();
  const Eigen::Vector3d end_offset(length_m * std::cos(start.yaw_rad),
                                   length_m * std::sin(start.yaw_rad), rise_m);
  const int pieces = std::max(1, static_cast<int>(std::ceil(length_m / kSample_m)));
  for (int i = 1; i <= pieces; ++i) {
    Add({start.position + end_offset * (static_cast<double>(i) / pieces), start.yaw_rad});
  }
  return *this;
}

DrivePath& DrivePath::Turn(double radius_m, double angle_rad) {
  const PathPoint start = points_.back();
  const double side = angle_rad < 0.0 ? -1.0 : 1.0;
  const auto normal = [&](double yaw_rad) -> Eigen::Vector3d {
    return Eigen::Vector3d(-std::sin(yaw_rad), std::cos(yaw_rad), 0.0) * (side * radius_m);
  };
  const Eigen::Vector3d centre = start.position + normal(start.yaw_rad);
  const int pieces =
      std::max(1, static_cast<int>(std::ceil(std::abs(angle_rad) * radius_m / kSample_m)));
  for (int i = 1; i <= pieces; ++i) {
    const double yaw_rad = start.yaw_rad + angle_rad * i / pieces;
    Add({centre - normal(yaw_rad), yaw_rad});
  }
  return *this;
}

PathPoint DrivePath::At(double along_m, double left_m) const {
  const double clamped_m = std::clamp(along_m, 0.0, length_m());
  const auto after = std::upper_bound(along_m_.begin(), along_m_.end(), clamped_m);
  const auto next = std::clamp<std::size_t>(static_cast<std::size_t>(after - along_m_.begin()), 1,
                                            std::max<std::size_t>(points_.size() - 1, 1));
  PathPoint point = points_.front();
  if (next < points_.size()) {
    const PathPoint& a = points_[next - 1];
    const PathPoint& b = points_[next];
    const double t = (clamped_m - along_m_[next - 1]) / (along_m_[next] - along_m_[next - 1]);
    point.position = a.position + t * (b.position - a.position);
    point.yaw_rad = a.yaw_rad + t * (b.yaw_rad - a.yaw_rad);
  }
  point.position +=
      left_m * Eigen::Vector3d(-std::sin(point.yaw_rad), std::cos(point.yaw_rad), 0.0);
  return point;
}

DrivePath DrivePath::Reversed() const {
  const auto turned = [](const PathPoint& point) {
    return PathPoint{point.position, point.yaw_rad + std::numbers::pi};
  };
  DrivePath reversed(turned(points_.back()));
  for (std::size_t i = points_.size() - 1; i-- > 0;) {
    reversed.Add(turned(points_[i]));
  }
  return reversed;
}

}  // namespace atlas
