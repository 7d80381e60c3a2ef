// A vehicle that drove off the map, carried on by its own motion from where it was known or told to
// be (decision 0624). Until it is known again the map does not move it: what fits there may be
// another place.
#include <cmath>
#include <utility>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {

bool PlaceTracker::LeavesMap(const RegistrationResult& tracked, const ScanFeatures& features) {
  trail_.BeginWay();
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
  if (trail_.is_empty()) {
    return false;
  }
  const PosePrior expected{Prior().T_world_level, motion_.StepCovariance()};
  const ScanMotion moved = trail_.MotionTo(features, expected);
  if (!trail_.IsKnown(moved)) {
    trail_.Clear();
    return false;
  }
  Go(moved);
  return true;
}

void PlaceTracker::Go(const ScanMotion& moved) {
  const double step_m = motion_.LastStep(moved.T_world_level).head<3>().norm();
  motion_.Carry(moved.T_world_level, trail_.Go(moved, step_m));
}

void PlaceTracker::Keep(const ScanFeatures& features,
                        const LocalizationResult& result,
                        bool is_found) {
  const bool is_lost = result.health == LocalizationHealth::kLost;
  const bool is_known = !is_lost && confirmation_.is_confirmed();
  const bool is_carried = carried_ > 0 && !is_known;
  if (!is_carried && (carried_ > 0 || is_found || is_lost)) {
    trail_.Clear();  // they lie where it is not
  }
  if (!is_carried) {
    carried_ = 0;
    drift_.EndCarry();
    if (!is_lost && !is_known) {
      trail_.Clear();
      return;
    }
    if (result.health != LocalizationHealth::kGood && !IsNearEdge(features, result)) {
      return;
    }
  }
  trail_.Keep(features, is_carried ? Prior().T_world_level : result.registration.T_world_level);
}

bool PlaceTracker::IsNearEdge(const ScanFeatures& features, const LocalizationResult& result) {
  const Pose& there = result.registration.T_world_level;
  if (result.health != LocalizationHealth::kWeak || trail_.is_empty() ||
      GroundMapped(map_.window(), features, there).value_or(1.0) >
          options_.edge.edge_ground_mapped) {
    return false;
  }
  const bool agrees =
      confirmation_.is_confirmed() && GoesWithRecent(features, {there, PoseCovariance::Zero()});
  if (!agrees) trail_.Clear();
  return agrees;
}

bool PlaceTracker::IsOnMap(const RegistrationResult& result,
                           const ScanFeatures& features,
                           double unknown_share) const {
  const double asked = confirmation_.IsEnough(result, features) ? options_.edge.least_ground_mapped
                                                                : options_.edge.min_ground_mapped;
  return GroundMapped(map_.window(), features, result.T_world_level).value_or(unknown_share) >=
         asked;
}

bool PlaceTracker::IsWithinReach(const Pose& T_world_level) const {
  return IsWithin(Prior(), T_world_level, options_.edge.reachable_sigmas,
                  options_.edge.reachable_up_sigmas);
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
  prior.radius_m = options_.edge.reachable_sigmas * SpreadOf(covariance).along_m;
  prior.z_m = expected.z();
  prior.height_m = options_.edge.reachable_up_sigmas * std::sqrt(covariance(2, 2));
  return prior;
}

bool PlaceTracker::IsBack(const RegistrationResult& result, const ScanFeatures& features) const {
  return confirmation_.IsEnough(result, features) && IsReachable(result.T_world_level) &&
         IsOnMap(result, features, 0.0);
}

}  // namespace atlas
