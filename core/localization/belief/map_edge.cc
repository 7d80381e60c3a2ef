#include "core/localization/belief/map_edge.h"

namespace atlas {

std::optional<double> GroundMapped(const MapWindow& map,
                                   const ScanFeatures& features,
                                   const Pose& T_world_level) {
  constexpr float kNear_m = 15.0F;
  constexpr float kReach_m = 0.6F;  // in height
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map.origin()).cast<float>();
  int near = 0;
  int mapped = 0;
  for (const Eigen::Vector3f& p : features.ground) {
    if (p.norm() > kNear_m) {
      continue;
    }
    ++near;
    mapped += map.NearestSurface(R * p + t, kReach_m) ? 1 : 0;
  }
  return near == 0 ? std::nullopt : std::optional(static_cast<double>(mapped) / near);
}

bool IsAtEdge(const MapWindow& map, const ScanFeatures& features, const Pose& T_world_level) {
  constexpr double kMapped = 0.7;
  return GroundMapped(map, features, T_world_level).value_or(1.0) < kMapped;
}

}  // namespace atlas
