// Worlds of planes and boxes: what each ray of a scan hits, and what that truly is.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/geometry/pose.h"
#include "core/scan/leveled_scan.h"
#include "core/scan/point_cloud.h"
#include "tests/core/support/synthetic_scan.h"

namespace atlas::testing {

enum class Surface : std::uint8_t { kGround, kWall, kRoof, kCeiling };

struct SurfaceHit {
  double range_m = 0.0;
  Surface surface = Surface::kGround;
};

// The part of the plane z = z_m + gradient . (x, y) over [low, high].
struct Patch {
  double z_m = 0.0;
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  Surface surface = Surface::kGround;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());

  double HeightAt(double x_m, double y_m) const {
    return z_m + gradient.x() * x_m + gradient.y() * y_m;
  }
  bool Covers(double x_m, double y_m) const {
    return x_m >= low.x() && x_m < high.x() && y_m >= low.y() && y_m < high.y();
  }
};

// Sides are walls, the top is a roof, the bottom a ceiling.
struct Box {
  Eigen::Vector3d low;
  Eigen::Vector3d high;
};

struct ShapeWorld {
  std::vector<Patch> patches;
  std::vector<Box> boxes;

  // The nearest surface in front of `origin`; `direction` of unit length.
  std::optional<SurfaceHit> Cast(const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction) const;
};

struct TruthScan {
  PointCloud cloud;  // sensor frame
  std::vector<Surface> truth;
};

// Ring after ring; returns beyond 100 m are lost.
TruthScan CastScan(const SyntheticSensor& sensor,
                   const ShapeWorld& world,
                   const Pose& T_world_sensor);

// The same as a levelled scan that segmentation made no mistake in. `T_world_level` turns about the
// vertical only.
LeveledScan CastLeveledScan(const SyntheticSensor& sensor,
                            const ShapeWorld& world,
                            const Pose& T_world_level);

// first, first + step, ... below `last`.
template <typename T>
std::vector<T> Steps(T first, T last, T step) {
  std::vector<T> values;
  values.reserve(static_cast<std::size_t>((last - first) / step) + 1);
  for (int i = 0; first + static_cast<T>(i) * step < last; ++i) {
    values.push_back(first + static_cast<T>(i) * step);
  }
  return values;
}

// One more return of a levelled scan that is made by hand.
void AddReturn(LeveledScan& scan, const Eigen::Vector3f& p_level, bool is_ground);

// Upright, turned by `yaw_rad`.
Pose UprightPose(const Eigen::Vector3d& position, double yaw_rad);

}  // namespace atlas::testing
