// Where what was tracked is in doubt, or the vehicle is adrift: other places around where it is
// expected, and whether one of them stands out.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/localization/place_tracker.h"

namespace atlas {

bool PlaceTracker::IsDoubtful(const RegistrationResult& result) const {
  return lost_ > 0 || result.fit < (is_first_ ? options_.good_fit : options_.min_fit) ||
         result.fit < options_.doubtful_fit * usual_fit_ ||
         result.column_fit < options_.doubtful_column_fit;
}

bool PlaceTracker::IsAdrift() const {
  return lost_ == 0 && SpreadOf(motion_.covariance()).along_m > options_.adrift_sigma_m;
}

double PlaceTracker::AdriftReach(const PoseCovariance& covariance) const {
  constexpr double kStep_m = 20.0;  // the window is not made anew with every scan
  const double along_m = SpreadOf(covariance).along_m;
  if (lost_ > 0 || along_m <= options_.adrift_sigma_m) {
    return 0.0;
  }
  const double reach_m = 2.0 * along_m;
  return std::min(std::ceil(reach_m / kStep_m) * kStep_m, options_.max_adrift_m);
}

SearchReach PlaceTracker::Reach(bool is_doubtful) const {
  if (IsAdrift()) {
    const HorizontalSpread spread = SpreadOf(motion_.covariance());
    return {std::min(2.0 * spread.along_m, options_.max_adrift_m),
            std::min(2.0 * spread.beside_m, options_.max_adrift_beside_m), options_.adrift_yaw_rad,
            std::atan2(spread.direction.y(), spread.direction.x())};
  }
  const SearchReach start = IsVagueStart() ? StartReach() : SearchReach{0.0, 0.0, 0.0};
  if (IsVagueStart() && !is_doubtful) return start;
  const auto widened = [&](double least, double most) {
    return std::min((1 + lost_) * least, most);
  };
  const SearchReach& least = options_.search_reach;
  const SearchReach& most = options_.max_search_reach;
  return {std::max(start.along_m, widened(least.along_m, most.along_m)),
          std::max(start.beside_m, widened(least.beside_m, most.beside_m)),
          std::max(start.yaw_rad, widened(least.yaw_rad, most.yaw_rad)), start.direction_rad};
}

PlaceTracker::Searched PlaceTracker::Search(const ScanFeatures& features,
                                            const RegistrationResult& tracked) {
  PoseSearchOptions search = options_.search;
  if (IsAdrift() || IsVagueStart()) {
    search.max_columns = options_.adrift_columns;
    search.candidates = options_.adrift_candidates;
  }
  // Else the prior may be wrong, too, or there is none.
  const bool is_doubtful = IsDoubtful(tracked);
  const bool is_as_expected = !is_doubtful && (!is_first_ || is_told_);
  const bool is_within_start = IsVagueStart() && !is_doubtful;
  std::vector<Place> places{At(tracked, is_as_expected)};
  for (const Pose& start : SearchPoses(map_.coarse(), map_.window().origin(), features,
                                       Prior().T_world_level, Reach(is_doubtful), search)) {
    Place place =
        At(Register(map_.window(), features, start, options_.registration), is_as_expected);
    const Pose& there = place.registration.T_world_level;
    if (IsReachable(there) && (!is_within_start || IsWithinStart(there))) {
      places.push_back(std::move(place));
    }
  }
  const auto best = std::max_element(places.begin() + 1, places.end(), IsLessLikely);
  if (best == places.end() || !StandsOut(places, *best)) {
    return {std::nullopt, RivalOf(places, places.front())};
  }
  return {best->registration, std::nullopt};
}

// The first of `places` is where the vehicle was tracked to.
bool PlaceTracker::StandsOut(const std::vector<Place>& places, const Place& best) const {
  const bool is_likelier =
      best.log_likelihood > places.front().log_likelihood + options_.believed_log_ratio;
  return is_likelier && std::none_of(places.begin() + 1, places.end(), [&](const Place& other) {
           return other.log_likelihood > best.log_likelihood - options_.unique_log_ratio &&
                  AreApart(other.registration.T_world_level, best.registration.T_world_level,
                           options_.search.apart_m, options_.search.apart_rad);
         });
}

}  // namespace atlas
