// A vehicle that drove off the map, carried on by its own motion from where it was known or told to
// be (decision 0624). Until it is known again the map does not move it: what fits there may be
// another place.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/LU>

#include "core/localization/place_tracker.h"

namespace atlas {

bool PlaceTracker::LeavesMap(const RegistrationResult& tracked, const ScanFeatures& features) {
  carried_m_ = 0.0;
  if (is_first_) {
    return is_told_ && (IsDoubtful(tracked) || !IsWithinReach(tracked.T_world_level) ||
                        !IsOnMap(tracked, features, 1.0));
  }
  if (!IsDoubtful(tracked) || !confirmation_.is_confirmed()) {
    return false;
  }
  RegistrationResult here = tracked;
  here.T_world_level = Prior().T_world_level;
  if (IsOnMap(here, features, 1.0)) {
    return false;
  }
  return CarryOn(features);
}

bool PlaceTracker::CarryOn(const ScanFeatures& features) {
  if (recent_.is_empty()) {
    return false;
  }
  const PosePrior expected{Prior().T_world_level, motion_.StepCovariance()};
  const ScanMotion moved = MotionSince(recent_, features, expected, options_.odometry);
  if (moved.fit < options_.odometry.min_fit) {
    recent_.Clear();
    return false;
  }
  motion_.Carry(moved.T_world_level, StepCovariance(moved));
  return true;
}

// What errs alike all the way adds the more to the variance the longer that is.
PoseCovariance PlaceTracker::StepCovariance(const ScanMotion& moved) {
  const double step_m = motion_.LastStep(moved.T_world_level).head<3>().norm();
  carried_m_ += step_m;
  const Eigen::Vector4d each(options_.step_m, options_.step_m, options_.step_up_m,
                             options_.step_rad);
  const Eigen::Vector4d drift(options_.drift, options_.drift, options_.drift_up, 0.0);
  PoseCovariance covariance = moved.covariance;
  covariance.diagonal() +=
      std::min(1.0, step_m) * each.cwiseAbs2() + 2.0 * carried_m_ * step_m * drift.cwiseAbs2();
  return covariance;
}

void PlaceTracker::Keep(const ScanFeatures& features,
                        const LocalizationResult& result,
                        bool is_found) {
  const bool is_lost = result.health == LocalizationHealth::kLost;
  const bool is_known = !is_lost && confirmation_.is_confirmed();
  const bool is_carried = carried_ > 0 && !is_known;
  if (!is_carried && (carried_ > 0 || is_found || is_lost)) {
    recent_.Clear();  // they lie where it is not
  }
  if (!is_carried) {
    carried_ = 0;
    off_carried_.reset();
    if (!is_lost && !is_known) {
      recent_.Clear();
      return;
    }
    if (result.health != LocalizationHealth::kGood && !IsNearEdge(features, result)) {
      return;
    }
  }
  const Pose there = is_carried ? Prior().T_world_level : result.registration.T_world_level;
  if (recent_.is_empty() ||
      AreApart(there, last_kept_, options_.kept_apart_m, options_.kept_apart_rad)) {
    recent_.Add(features, there);
    last_kept_ = there;
  }
}

bool PlaceTracker::IsNearEdge(const ScanFeatures& features, const LocalizationResult& result) {
  const Pose& there = result.registration.T_world_level;
  if (result.health != LocalizationHealth::kWeak || recent_.is_empty() ||
      GroundMapped(map_.window(), features, there).value_or(1.0) > options_.edge_ground_mapped) {
    return false;
  }
  const bool agrees =
      confirmation_.is_confirmed() && GoesWithRecent(features, {there, PoseCovariance::Zero()});
  if (!agrees) recent_.Clear();
  return agrees;
}

bool PlaceTracker::IsOnMap(const RegistrationResult& result,
                           const ScanFeatures& features,
                           double unknown_share) const {
  const double asked = confirmation_.IsEnough(result, features) ? options_.least_ground_mapped
                                                                : options_.min_ground_mapped;
  return GroundMapped(map_.window(), features, result.T_world_level).value_or(unknown_share) >=
         asked;
}

bool PlaceTracker::IsWithinReach(const Pose& T_world_sensor) const {
  constexpr std::array<int, 3> kPlane{0, 1, 3};
  const PosePrior prior = Prior();
  const Eigen::Vector4d off = PoseDifference(prior.T_world_level, T_world_sensor);
  const Eigen::Vector3d in_plane = off(kPlane);
  const Eigen::Matrix3d plane = prior.covariance(kPlane, kPlane);
  const double sigmas = std::sqrt(in_plane.dot(plane.inverse() * in_plane));
  return sigmas <= options_.reachable_sigmas &&
         std::abs(off(2)) <= options_.reachable_up_sigmas * std::sqrt(prior.covariance(2, 2));
}

bool PlaceTracker::IsReachable(const Pose& T_world_sensor) const {
  return carried_ == 0 || IsWithinReach(T_world_sensor);
}

std::optional<PlacePrior> PlaceTracker::Within() const {
  if (carried_ == 0) {
    return std::nullopt;
  }
  const MotionModel next = Next();
  const Eigen::Vector3d& expected = next.T_world_sensor().translation();
  const PoseCovariance covariance = next.covariance();
  PlacePrior prior;
  prior.center = expected.head<2>();
  prior.radius_m = options_.reachable_sigmas * SpreadOf(covariance).along_m;
  prior.z_m = expected.z();
  prior.height_m = options_.reachable_up_sigmas * std::sqrt(covariance(2, 2));
  return prior;
}

bool PlaceTracker::IsBack(const RegistrationResult& result, const ScanFeatures& features) const {
  return confirmation_.IsEnough(result, features) && IsReachable(result.T_world_level) &&
         IsOnMap(result, features, 0.0);
}

}  // namespace atlas
