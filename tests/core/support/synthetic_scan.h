// Scans of worlds that a formula describes: a spinning sensor and the distance along each of its
// rays.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "core/scan/point_cloud.h"

namespace atlas::testing {

inline constexpr double kDegree = std::numbers::pi / 180.0;

struct SyntheticSensor {
  std::vector<double> elevation_deg;  // bottom first
  int columns = 1800;
  bool is_top_first = false;
};

inline std::vector<double> Rings(int count, double lowest_deg, double spacing_deg) {
  std::vector<double> rings;
  for (int i = 0; i < count; ++i) {
    rings.push_back(lowest_deg + i * spacing_deg);
  }
  return rings;
}

inline SyntheticSensor Vlp16() {
  return {Rings(16, -15.0, 2.0)};
}

// Distance along the ray in the unit direction (sensor frame); nullopt: no return.
using World = std::function<std::optional<double>(const Eigen::Vector3d& direction)>;

// Returns beyond 100 m are lost.
inline PointCloud Scan(const SyntheticSensor& sensor, const World& world) {
  PointCloud cloud;
  std::vector<double> rings = sensor.elevation_deg;
  if (sensor.is_top_first) {
    rings.assign(sensor.elevation_deg.rbegin(), sensor.elevation_deg.rend());
  }
  for (const double elevation_deg : rings) {
    for (int column = 0; column < sensor.columns; ++column) {
      const double azimuth = (column + 0.5) * 2.0 * std::numbers::pi / sensor.columns;
      const double elevation = elevation_deg * kDegree;
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const std::optional<double> range = world(direction);
      if (range && *range < 100.0) {
        cloud.points.emplace_back((*range * direction).cast<float>());
      }
    }
  }
  return cloud;
}

// Flat ground `height_m` below the sensor.
inline std::optional<double> GroundRange(const Eigen::Vector3d& direction, double height_m) {
  return direction.z() < 0.0 ? std::optional<double>(-height_m / direction.z()) : std::nullopt;
}

// A round wall at `radius_m`, from the ground up.
inline std::optional<double> RoundWallRange(const Eigen::Vector3d& direction, double radius_m) {
  return radius_m / direction.head<2>().norm();
}

inline std::optional<double> Nearest(std::optional<double> a, std::optional<double> b) {
  return !a || (b && *b < *a) ? b : a;
}

}  // namespace atlas::testing
