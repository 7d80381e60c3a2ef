// Where what was tracked is in doubt, or the vehicle is adrift: other places around where it is
// expected, and whether one of them stands out.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {

bool PlaceTracker::IsDoubtful(const RegistrationResult& result) const {
  return lost_ > 0 ||
         result.fit < (is_first_ ? options_.health.good_fit : options_.health.min_fit) ||
         result.fit < options_.doubt.fit * usual_fit_ ||
         result.column_fit < options_.doubt.column_fit;
}

bool PlaceTracker::IsAdrift() const {
  return lost_ == 0 && SpreadOf(motion_.covariance()).along_m > options_.adrift.sigma_m;
}

double PlaceTracker::AdriftReach(const PoseCovariance& covariance) const {
  constexpr double kStep_m = 20.0;  // the window is not made anew with every scan
  const double along_m = SpreadOf(covariance).along_m;
  if (lost_ > 0 || along_m <= options_.adrift.sigma_m) {
    return 0.0;
  }
  const double reach_m = 2.0 * along_m;
  return std::min(std::ceil(reach_m / kStep_m) * kStep_m, options_.adrift.max_m);
}

SearchReach PlaceTracker::Reach(bool is_doubtful) const {
  if (IsAdrift()) {
    const HorizontalSpread spread = SpreadOf(motion_.covariance());
    return {std::min(2.0 * spread.along_m, options_.adrift.max_m),
            std::min(2.0 * spread.beside_m, options_.adrift.max_beside_m), options_.adrift.yaw_rad,
            std::atan2(spread.direction.y(), spread.direction.x())};
  }
  const SearchReach start = IsVagueStart() ? StartReach() : SearchReach{0.0, 0.0, 0.0};
  if (IsVagueStart() && !is_doubtful) return start;
  const auto widened = [&](double least, double most) {
    return std::min((1 + lost_) * least, most);
  };
  const SearchReach& least = options_.doubt.search_reach;
  const SearchReach& most = options_.doubt.max_search_reach;
  return {std::max(start.along_m, widened(least.along_m, most.along_m)),
          std::max(start.beside_m, widened(least.beside_m, most.beside_m)),
          std::max(start.yaw_rad, widened(least.yaw_rad, most.yaw_rad)), start.direction_rad};
}

PlaceTracker::Searched PlaceTracker::Search(const ScanFeatures& features,
                                            const RegistrationResult& tracked) {
  PoseSearchOptions search = options_.search;
  if (IsAdrift() || IsVagueStart()) {
    search.max_columns = options_.adrift.columns;
    search.candidates = options_.adrift.candidates;
  }
  // Else the prior may be wrong, too, or there is none.
  const bool is_doubtful = IsDoubtful(tracked);
  const bool is_as_expected = !is_doubtful && (!is_first_ || is_told_);
  const bool is_within_start = IsVagueStart() && !is_doubtful;
  std::vector<PlaceHypothesis> places{At(tracked, is_as_expected)};
  for (const Pose& start : SearchPoses(map_.coarse(), map_.window().origin(), features,
                                       Prior().T_world_level, Reach(is_doubtful), search)) {
    PlaceHypothesis place =
        At(Register(map_.window(), features, start, options_.registration), is_as_expected);
    const Pose& there = place.registration.T_world_level;
    if (IsReachable(there) && (!is_within_start || IsWithinStart(there))) {
      places.push_back(std::move(place));
    }
  }
  const auto best = std::max_element(places.begin() + 1, places.end(), IsLessLikely);
  if (best == places.end() || !StandsOut(places, *best, options_.hypotheses)) {
    return {std::nullopt, RivalOf(places, places.front(), options_.hypotheses)};
  }
  return {best->registration, std::nullopt};
}

}  // namespace atlas
