// A vehicle that drove off the map, carried on by its own motion from where it was known (decision
// 0624).
#include "core/localization/place_tracker.h"

namespace atlas {

bool PlaceTracker::LeavesMap(const RegistrationResult& tracked, const ScanFeatures& features) {
  return carried_ == 0 && lost_ == 0 && IsDoubtful(tracked) &&
         GroundMapped(features, Prior().T_world_level) < options_.min_ground_mapped &&
         CarryOn(features);
}

bool PlaceTracker::CarryOn(const ScanFeatures& features) {
  if (recent_.is_empty()) {
    return false;
  }
  const ScanMotion moved = MotionSince(recent_, features, Prior().T_world_level, options_.odometry);
  if (moved.fit < options_.odometry.min_fit) {
    recent_.Clear();
    return false;
  }
  motion_.Carry(moved.T_world_level, moved.covariance);
  return true;
}

void PlaceTracker::Keep(const ScanFeatures& features, const LocalizationResult& result) {
  const bool is_lost = result.health == LocalizationHealth::kLost;
  const bool is_good = result.health == LocalizationHealth::kGood;
  if (carried_ > 0 || is_good || IsNearEdge(features, result)) {
    recent_.Add(features, is_lost ? Prior().T_world_level : result.registration.T_world_level);
  } else if (is_lost || !confirmation_.is_confirmed()) {
    recent_.Clear();
  }
  if (is_good) carried_ = 0;
}

bool PlaceTracker::IsNearEdge(const ScanFeatures& features,
                              const LocalizationResult& result) const {
  const Pose& there = result.registration.T_world_level;
  if (result.health != LocalizationHealth::kWeak || !confirmation_.is_confirmed() ||
      recent_.is_empty() || GroundMapped(features, there) > options_.edge_ground_mapped) {
    return false;
  }
  const ScanMotion moved = MotionSince(recent_, features, there, options_.odometry);
  return moved.fit >= options_.odometry.min_fit &&
         !AreApart(moved.T_world_level, there, options_.same_step_m, options_.same_step_rad);
}

double PlaceTracker::GroundMapped(const ScanFeatures& features, const Pose& T_world_level) const {
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map_.window().origin()).cast<float>();
  int near = 0;
  int mapped = 0;
  for (const Eigen::Vector3f& p : features.ground) {
    if (p.norm() > options_.near_ground_m) {
      continue;
    }
    ++near;
    mapped += map_.window().NearestSurface(R * p + t, options_.ground_reach_m) ? 1 : 0;
  }
  return near == 0 ? 1.0 : static_cast<double>(mapped) / near;
}

bool PlaceTracker::IsReachable(const Pose& T_world_sensor) const {
  const double most = options_.reachable_sigmas;
  return carried_ == 0 || LogDensity(Prior(), T_world_sensor) >= -0.5 * most * most;
}

bool PlaceTracker::IsBack(const RegistrationResult& result, const ScanFeatures& features) const {
  return !IsDoubtful(result) && IsReachable(result.T_world_level) &&
         GroundMapped(features, result.T_world_level) >= options_.min_ground_mapped;
}

}  // namespace atlas
