// A start that is known to some metres: bays and posts repeat, so that a scan may fit well where it
// was not taken. Other places are tried in what is known of the start (decision 0626).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {

bool PlaceTracker::IsVagueStart() const {
  if (!is_first_ || carried_ > 0 || !confirmation_.is_confirmed()) {
    return false;
  }
  const SearchReach reach = StartReach();
  return reach.along_m >= options_.hypotheses.apart_m ||
         reach.yaw_rad >= options_.hypotheses.apart_rad;
}

SearchReach PlaceTracker::StartReach() const {
  if (!is_told_) {
    const double within_m = std::min(hint_.within_m, options_.start.max_m);
    return {within_m, within_m, std::min(hint_.within_rad, std::numbers::pi)};
  }
  const PoseCovariance covariance = motion_.covariance();
  const HorizontalSpread spread = SpreadOf(covariance);
  const double sigmas = options_.edge.reachable_sigmas;
  return {sigmas * spread.along_m, sigmas * spread.beside_m, sigmas * std::sqrt(covariance(3, 3)),
          std::atan2(spread.direction.y(), spread.direction.x())};
}

bool PlaceTracker::IsWithinStart(const Pose& T_world_level) const {
  if (is_told_) {
    return IsWithinReach(T_world_level);
  }
  const Eigen::Vector4d off = PoseDifference(Prior().T_world_level, T_world_level);
  return off.head<2>().lpNorm<Eigen::Infinity>() <= hint_.within_m + options_.start.beyond_m &&
         std::abs(off(3)) <= hint_.within_rad + options_.start.beyond_rad;
}

}  // namespace atlas
