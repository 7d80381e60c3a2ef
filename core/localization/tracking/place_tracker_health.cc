// How far a localizer's answer can be believed.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {

// What was tracked is expected: nothing else was found. After scans that were lost the vehicle may
// be anywhere, unless what is seen is what was expected.
PlaceTracker::Surprise PlaceTracker::SurpriseOf(const RegistrationResult& result,
                                                const ScanFeatures& features,
                                                bool is_found) const {
  const PosePrior prior = Prior();
  const Eigen::Vector4d off = PoseDifference(prior.T_world_level, result.T_world_level);
  if (is_first_ && carried_ == 0) {
    const bool is_told =
        IsWithinStart(result.T_world_level) && std::abs(off(2)) <= options_.start.up_m;
    return is_told ? Surprise::kNone : Surprise::kNew;
  }
  if (carried_ > 0) {
    const bool is_back_soon = carried_ <= options_.doubt.max_coasting &&
                              !IsAtEdge(features, result.T_world_level) &&
                              confirmation_.IsAsUsual(result, features, usual_fit_);
    return is_back_soon ? Surprise::kNone : Surprise::kOdd;
  }
  if (lost_ == 0 && !is_found) {
    const bool may_have_stood = at_hand_.has_paused && IsAtEdge(features, result.T_world_level);
    return at_hand_.has_stood || may_have_stood || at_hand_.has_broken || at_hand_.has_strayed
               ? Surprise::kOdd
               : Surprise::kNone;
  }
  const bool is_near = off.head<3>().norm() <= options_.surprise.near_m &&
                       std::abs(off(3)) <= options_.surprise.near_rad;
  const bool is_likely = LogDensity(prior, result.T_world_level) > options_.surprise.log_density;
  if (at_hand_.has_strayed) {
    return Surprise::kOdd;
  }
  if (at_hand_.has_broken) {
    return is_near ? Surprise::kOdd : Surprise::kNew;
  }
  if ((lost_ == 0 && is_likely) || (lost_ <= options_.doubt.max_coasting && is_near &&
                                    confirmation_.IsAsUsual(result, features, usual_fit_))) {
    return Surprise::kNone;
  }
  return lost_ == 0 && is_near ? Surprise::kOdd : Surprise::kNew;
}

void PlaceTracker::Confirm(const ScanFeatures& features,
                           Surprise surprise,
                           bool is_found,
                           LocalizationResult& result) {
  if (result.health == LocalizationHealth::kLost) {
    confirmation_.Miss();
    return;
  }
  if (surprise == Surprise::kNew || (is_found && IsAdrift())) {
    confirmation_.Doubt();
    is_elsewhere_ = true;
    was_anywhere_ = was_anywhere_ || surprise == Surprise::kNew;
  } else if (surprise == Surprise::kOdd) {
    confirmation_.Question();
    is_elsewhere_ = is_elsewhere_ || at_hand_.has_broken;
  }
  if (!confirmation_.is_confirmed() && !MovesAsSeen(features, result.registration)) {
    confirmation_.Miss();
  }
  const bool was_confirmed = confirmation_.is_confirmed();
  const double up_m = result.registration.T_world_level.translation().z();
  // At the edge of the map another deck, of which more was mapped, explains more of a scan.
  const bool is_compared =
      !confirmation_.is_confirmed() || !IsAtEdge(features, result.registration.T_world_level);
  auto there = is_compared ? confirmation_.Weigh(map_.window(), features, result.registration,
                                                 usual_fit_, IsDoubtful(result.registration))
                           : std::nullopt;
  if (there) {
    if (!IsReachable(there->T_world_level)) {
      result.health = LocalizationHealth::kLost;
      return;
    }
    result.registration = *std::move(there);
    is_elsewhere_ = true;
    motion_.Raise(result.registration.T_world_level.translation().z() - up_m);
  }
  if (!was_confirmed && confirmation_.is_confirmed() && is_elsewhere_ &&
      RepeatsBeside(result.registration, features)) {
    confirmation_.Doubt();
  }
  if (confirmation_.is_confirmed()) drift_.Confirm();
  if (!confirmation_.is_confirmed() || confirmation_.is_suspected()) {
    result.health = LocalizationHealth::kWeak;
  }
}

// Of rows of posts or bays one is as good as the next, and moves as the vehicle does.
bool PlaceTracker::RepeatsBeside(const RegistrationResult& found, const ScanFeatures& features) {
  const std::vector<Pose> starts =
      SearchPoses(map_.coarse(), map_.window().origin(), features, found.T_world_level,
                  options_.doubt.beside, options_.search);
  return std::any_of(starts.begin(), starts.end(), [&](const Pose& start) {
    const RegistrationResult other =
        Register(map_.window(), features, start, options_.registration);
    return !IsSamePlace(other.T_world_level, found.T_world_level, options_.hypotheses) &&
           At(other, false).log_likelihood >
               At(found, false).log_likelihood - options_.hypotheses.unique_log_ratio;
  });
}

bool PlaceTracker::IsHeld(const RegistrationResult& result, const ScanFeatures& features) const {
  return features.columns.size() < options_.health.few_columns ||
         result.column_inliers >= options_.health.min_columns;
}

LocalizationHealth PlaceTracker::Judge(const RegistrationResult& result,
                                       const ScanFeatures& features,
                                       Surprise surprise) const {
  if (carried_ > 0 && !IsBack(result, features)) {
    return LocalizationHealth::kLost;
  }
  if ((surprise != Surprise::kNone && !is_first_) || !confirmation_.is_confirmed()
          ? !confirmation_.IsEnough(result, features)
          : result.fit < options_.health.min_fit) {
    return LocalizationHealth::kLost;
  }
  return WorstSigma(result) > options_.health.max_weak_sigma_m ||
                 result.fit < options_.health.good_fit || !IsHeld(result, features)
             ? LocalizationHealth::kWeak
             : LocalizationHealth::kGood;
}

LocalizationResult PlaceTracker::Doubted(LocalizationResult result) const {
  if (result.health == LocalizationHealth::kGood) result.health = LocalizationHealth::kWeak;
  result.covariance = motion_.covariance() + confirmation_.Spread();
  return result;
}

// Wider where it is not known that this is the place.
PoseCovariance PlaceTracker::Covariance(const LocalizationResult& result) const {
  const bool is_poor = result.health == LocalizationHealth::kWeak &&
                       result.registration.fit < options_.health.good_fit;
  const bool is_carried = carried_ > 0 && result.health == LocalizationHealth::kLost;
  const bool is_known = is_carried || (confirmation_.is_confirmed() && !is_poor &&
                                       unheld_ <= options_.health.most_unheld &&
                                       lost_ < options_.health.told_lost_after);
  return is_known ? motion_.covariance() : motion_.covariance() + confirmation_.Spread();
}

}  // namespace atlas
