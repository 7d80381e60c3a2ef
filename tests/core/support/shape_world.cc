#include "tests/core/support/shape_world.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace atlas::testing {
namespace {

constexpr double kNearest_m = 1e-6;

std::optional<SurfaceHit> CastPatch(const Patch& patch,
                                    const Eigen::Vector3d& origin,
                                    const Eigen::Vector3d& direction) {
  const double falling = direction.z() - patch.gradient.dot(direction.head<2>());
  const double range_m = (patch.HeightAt(origin.x(), origin.y()) - origin.z()) / falling;
  const Eigen::Vector3d p = origin + range_m * direction;
  if (!(range_m > kNearest_m) || !std::isfinite(range_m) || !patch.Covers(p.x(), p.y())) {
    return std::nullopt;
  }
  return SurfaceHit{range_m, patch.surface};
}

std::optional<SurfaceHit> CastBox(const Box& box,
                                  const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) {
  double enter = kNearest_m;
  double leave = std::numeric_limits<double>::infinity();
  int entered_axis = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.low(axis) - origin(axis)) / direction(axis);
    const double b = (box.high(axis) - origin(axis)) / direction(axis);
    if (std::min(a, b) > enter) {
      enter = std::min(a, b);
      entered_axis = axis;
    }
    leave = std::min(leave, std::max(a, b));
  }
  if (entered_axis < 0 || enter >= leave) {
    return std::nullopt;
  }
  const Surface level = direction.z() < 0.0 ? Surface::kRoof : Surface::kCeiling;
  return SurfaceHit{enter, entered_axis == 2 ? level : Surface::kWall};
}

void KeepNearer(const std::optional<SurfaceHit>& hit, std::optional<SurfaceHit>& nearest) {
  if (hit && (!nearest || hit->range_m < nearest->range_m)) {
    nearest = hit;
  }
}

}  // namespace

std::optional<SurfaceHit> ShapeWorld::Cast(const Eigen::Vector3d& origin,
                                           const Eigen::Vector3d& direction) const {
  std::optional<SurfaceHit> nearest;
  for (const Patch& patch : patches) {
    KeepNearer(CastPatch(patch, origin, direction), nearest);
  }
  for (const Box& box : boxes) {
    KeepNearer(CastBox(box, origin, direction), nearest);
  }
  return nearest;
}

TruthScan CastScan(const SyntheticSensor& sensor,
                   const ShapeWorld& world,
                   const Pose& T_world_sensor) {
  TruthScan scan;
  scan.cloud = Scan(sensor, [&](const Eigen::Vector3d& direction) -> std::optional<double> {
    const auto hit = world.Cast(T_world_sensor.translation(), T_world_sensor.linear() * direction);
    if (!hit || hit->range_m >= 100.0) {
      return std::nullopt;
    }
    scan.truth.push_back(hit->surface);
    return hit->range_m;
  });
  return scan;
}

LeveledScan CastLeveledScan(const SyntheticSensor& sensor,
                            const ShapeWorld& world,
                            const Pose& T_world_level) {
  const TruthScan truth = CastScan(sensor, world, T_world_level);
  LeveledScan scan;
  for (std::size_t i = 0; i < truth.cloud.size(); ++i) {
    AddReturn(scan, truth.cloud.points[i], truth.truth[i] == Surface::kGround);
  }
  scan.column_spacing_rad = 2.0F * std::numbers::pi_v<float> / static_cast<float>(sensor.columns);
  return scan;
}

void AddReturn(LeveledScan& scan, const Eigen::Vector3f& p_level, bool is_ground) {
  scan.x.push_back(p_level.x());
  scan.y.push_back(p_level.y());
  scan.z.push_back(p_level.z());
  scan.range_m.push_back(p_level.head<2>().norm());
  const float azimuth_rad = std::atan2(p_level.y(), p_level.x());
  scan.azimuth_rad.push_back(azimuth_rad < 0.0F ? azimuth_rad + 2.0F * std::numbers::pi_v<float>
                                                : azimuth_rad);
  scan.is_ground.push_back(is_ground ? 1 : 0);
}

Pose UprightPose(const Eigen::Vector3d& position, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.translation() = position;
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

}  // namespace atlas::testing
