#include "core/localization/tracking/place_tracker.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/localization/belief/other_decks.h"
#include "core/localization/registration/feature_fit.h"

namespace atlas {
PlaceTracker::PlaceTracker(const MapProfile& profile,
                           TilesAround tiles,
                           const PlaceTrackerOptions& options,
                           double max_range_m)
    : options_(options),
      max_range_m_(max_range_m),
      cell_size_m_(profile.cell_size_m()),
      map_(profile, std::move(tiles), options.map),
      motion_(options.motion),
      confirmation_(options.confirmation, options.registration),
      trail_(options.trail),
      drift_(options.drift) {}

void PlaceTracker::Start(const Pose& T_world_sensor, const StartKnowledge& known) {
  const auto* covariance = std::get_if<PoseCovariance>(&known);
  is_told_ = covariance != nullptr;
  if (is_told_) {
    motion_.Start(T_world_sensor, *covariance);
  } else {
    motion_.Start(T_world_sensor);
    hint_ = std::get<StartHint>(known);
  }
  confirmation_.Trust();
  is_first_ = true;
  is_elsewhere_ = false;
  was_anywhere_ = false;
  untracked_ = 0.0;
  usual_fit_ = 0.0;
  lost_ = 0;
  known_ = 0;
  unheld_ = 0;
  without_map_ = 0;
  trail_.Clear();
  drift_.Clear();
  carried_ = 0;
}

void PlaceTracker::Suppose(const Pose& T_world_sensor, double usual_fit) {
  Start(T_world_sensor, StartHint());
  confirmation_.Doubt();
  is_elsewhere_ = true;
  usual_fit_ = usual_fit;
}

void PlaceTracker::ColumnWeights(const ScanFeatures& features,
                                 const Pose& T_world_level,
                                 std::vector<std::optional<float>>& weights) const {
  FeatureFit(map_.window(), features, options_.registration.features)
      .ColumnWeights(T_world_level, options_.registration.fine_radius_m, weights);
}

MotionModel PlaceTracker::Next() const {
  MotionModel next = motion_;
  if (!is_first_ && scans_ > options_.pause.most_predicted) {
    next.ForgetMotion();
    next.Predict();
  } else if (!is_first_) {
    next.Predict(scans_);
  }
  return next;
}

bool PlaceTracker::GoesAlong() const {
  return !is_first_ && carried_ == 0 && lost_ == 0 &&
         (!confirmation_.is_confirmed() ||
          SpreadOf(Next().covariance()).along_m > options_.adrift.fan_sigma_m);
}

Status PlaceTracker::Prepare() {
  const MotionModel next = Next();
  return map_.Renew(next.T_world_sensor().translation(),
                    max_range_m_ + AdriftReach(next.covariance()));
}

LocalizationResult PlaceTracker::Track(const ScanFeatures& features,
                                       const Eigen::Quaterniond& R_level_sensor,
                                       const std::optional<OwnStep>& step) {
  at_hand_ = {};
  const bool goes_along = step && GoesAlong();
  at_hand_.has_paused = !is_first_ && scans_ > options_.pause.most_missing;
  at_hand_.has_stood = HasStood(features);
  const MotionModel before = motion_;
  if (!at_hand_.has_stood) {
    motion_ = Arrived(features);
  }
  untracked_ = 0.0;
  if (goes_along) {
    GoAlong(*step);
  }
  if (carried_ > 0) {
    carried_ += at_hand_.has_paused ? options_.doubt.max_coasting : 1;
    if (!CarryOn(features)) {
      lost_ = std::exchange(carried_, 0);  // as anyone who is
    }
  }
  const bool is_on_map = carried_ == 0 && lost_ == 0;
  Tracked tracked = Follow(features);
  if (is_on_map && LeavesMap(tracked.place.registration, features)) {
    carried_ = 1;
    tracked = Follow(features);
  }
  Located located = Locate(features, std::move(tracked));
  if (is_on_map && carried_ == 0 && Strays(located.registration, features)) {
    located = Locate(features, Follow(features));
  } else if (located.is_found && is_on_map && carried_ == 0 && !goes_along) {
    ArriveAt(located.registration.T_world_level, before);
  }
  LocalizationResult result;
  result.registration = std::move(located.registration);
  const bool is_found = located.is_found;
  const Surprise surprise = SurpriseOf(result.registration, features, is_found);
  result.health = Judge(result.registration, features, surprise);
  Confirm(features, surprise, is_found, result);
  unheld_ = carried_ > 0 || IsHeld(result.registration, features) ? 0 : unheld_ + 1;
  result.T_world_sensor = result.health == LocalizationHealth::kLost
                              ? Prior().T_world_level
                              : result.registration.T_world_level;
  result.T_world_sensor.linear() *= R_level_sensor.toRotationMatrix();
  const CoverAtScan cover =
      CoverAt(map_.window(), features, result.registration.T_world_level, cell_size_m_);
  result.cover = cover.map;
  NoteCover(cover.map);
  if (result.health == LocalizationHealth::kGood &&
      (located.rival || cover.map != MapCover::kFine)) {
    result.health = LocalizationHealth::kWeak;
  }
  // Of a first scan at the edge of the map no motion tells whether it is there.
  const bool is_unchecked = is_first_ && IsAtEdge(features, result.registration.T_world_level);
  Remember(result, SeenInformation(result.registration, cover, located.rival, options_.seen),
           is_found);
  Keep(features, result, is_found);
  result.covariance = Covariance(result);
  const double up_m = std::sqrt(result.covariance(2, 2));
  if (result.health == LocalizationHealth::kGood &&
      (up_m > options_.health.max_weak_up_m || is_unchecked)) {
    result.health = LocalizationHealth::kWeak;
  }
  return result;
}

PlaceTracker::Located PlaceTracker::Locate(const ScanFeatures& features, Tracked tracked) {
  Located located{std::move(tracked.place.registration), tracked.rival, false};
  if (!IsDoubtful(located.registration) && !IsAdrift() && !IsVagueStart() && carried_ == 0) {
    return located;
  }
  // Lost for long it is anywhere, and looked for in all the map.
  if (lost_ > options_.doubt.max_coasting && lost_ % options_.doubt.looked_again_after != 0) {
    return located;
  }
  Searched searched = Search(features, located.registration);
  if (searched.found) {
    return {*std::move(searched.found), std::nullopt, true};
  }
  if (IsVagueStart() && searched.rival) located.rival = searched.rival;
  return located;
}

// Tiles that are on their way come to a vehicle that stands, too.
void PlaceTracker::NoteCover(MapCover cover) {
  without_map_ = cover == MapCover::kFine ? 0 : without_map_ + 1;
  if (without_map_ == options_.asked_again_after) {
    without_map_ = 0;
    map_.Expire();
  }
}

void PlaceTracker::Remember(const LocalizationResult& result,
                            const Eigen::Matrix4d& seen,
                            bool is_found) {
  const bool is_next = !is_first_ && lost_ == 0 && carried_ == 0;
  is_first_ = false;
  known_ = result.health == LocalizationHealth::kGood ? known_ + 1 : 0;
  was_anywhere_ = was_anywhere_ && known_ < options_.surprise.long_known;
  if (result.health == LocalizationHealth::kGood) {
    const double fit = result.registration.fit;
    usual_fit_ = usual_fit_ == 0.0 ? fit : 0.8 * usual_fit_ + 0.2 * fit;
  }
  if (result.health == LocalizationHealth::kLost) {
    motion_.SetTilt(result.T_world_sensor.linear());
    if (carried_ == 0 && ++lost_ > options_.doubt.max_coasting) {
      motion_.ForgetMotion();  // looked for where it got to
    }
    return;
  }
  if (carried_ > 0 && !confirmation_.is_confirmed()) {
    motion_.SetTilt(result.T_world_sensor.linear());
    return;
  }
  if (!is_found ||
      LogDensity(Prior(), result.registration.T_world_level) > options_.surprise.log_density) {
    motion_.Correct(result.T_world_sensor, seen);
  } else if (is_next) {
    motion_.Turn(result.T_world_sensor, seen);
  } else {
    motion_.Relocate(result.T_world_sensor, seen);
  }
  lost_ = 0;
}

// What the IMU says about the vertical replaces the tilt that was predicted.
PosePrior PlaceTracker::PriorOf(const MotionModel& motion) {
  return {LevelFrame(motion.T_world_sensor()), motion.covariance()};
}

PlaceHypothesis PlaceTracker::At(const RegistrationResult& registration, bool has_prior) const {
  const double prior = has_prior ? LogDensity(Prior(), registration.T_world_level) : 0.0;
  return {registration, options_.hypotheses.evidence_share * registration.evidence + prior};
}

void PlaceTracker::SpreadStarts(const PosePrior& prior) {
  starts_.assign(1, prior.T_world_level);
  const HorizontalSpread spread = SpreadOf(prior.covariance);
  if (spread.along_m < options_.adrift.fan_sigma_m) {
    return;
  }
  const double reach_m = 2.0 * std::min(spread.along_m, options_.adrift.sigma_m);
  const int steps = static_cast<int>(reach_m / options_.adrift.fan_step_m);
  for (int step = -steps; step <= steps; ++step) {
    if (step == 0) {
      continue;  // is the first of all
    }
    starts_.push_back(prior.T_world_level);
    starts_.back().translation().head<2>() += step * options_.adrift.fan_step_m * spread.direction;
  }
}

void PlaceTracker::RaiseStarts(const PosePrior& prior, const ScanFeatures& features) {
  DeckFinder surfaces(
      {.reach_m = options_.edge.reachable_up_sigmas * std::sqrt(prior.covariance(2, 2)),
       .apart_m = options_.start.told_step_m,
       .least_m = options_.start.told_step_m});
  const std::size_t level = starts_.size();
  for (const double up_m : surfaces.Find(map_.window(), features, prior.T_world_level)) {
    for (std::size_t i = 0; i < level; ++i) {
      starts_.push_back(starts_[i]);
      starts_.back().translation().z() += up_m;
    }
  }
}

PlaceTracker::Tracked PlaceTracker::Follow(const ScanFeatures& features) {
  const PosePrior prior = Prior();
  if (is_first_ && !is_told_) {
    return {
        At(Register(map_.window(), features, prior.T_world_level, options_.registration), false),
        std::nullopt};
  }
  const PosePrior among_features{prior.T_world_level,
                                 options_.seen.information_share * prior.covariance};
  SpreadStarts(prior);
  if (is_first_) RaiseStarts(prior, features);
  places_.clear();
  for (const Pose& start : starts_) {
    places_.push_back(
        At(Register(map_.window(), features, start, among_features, options_.registration), true));
  }
  const auto best = std::max_element(places_.begin(), places_.end(), IsLessLikely);
  return {*best, RivalOf(places_, *best, options_.hypotheses)};
}

}  // namespace atlas
