#include "core/localization/place_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/localization/feature_fit.h"
#include "core/localization/other_decks.h"

namespace atlas {
namespace {

Eigen::Matrix4d PoseInformation(const Eigen::Matrix<double, 6, 6>& information) {
  constexpr std::array<int, 4> kAxes{0, 1, 2, 5};
  return information(kAxes, kAxes);
}

}  // namespace

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
      trail_(options.trail) {}

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
  strayed_.setZero();
  moved_off_.setZero();
  carried_ = 0;
  off_carried_.reset();
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
  if (!is_first_ && scans_ > options_.most_predicted) {
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
          SpreadOf(Next().covariance()).along_m > options_.fan_sigma_m);
}

Status PlaceTracker::Prepare() {
  const MotionModel next = Next();
  return map_.Renew(next.T_world_sensor().translation(),
                    max_range_m_ + AdriftReach(next.covariance()));
}

LocalizationResult PlaceTracker::Track(const ScanFeatures& features,
                                       const Eigen::Quaterniond& R_level_sensor,
                                       const std::optional<OwnStep>& step) {
  own_step_.reset();
  has_broken_ = false;
  has_strayed_ = false;
  const bool goes_along = step && GoesAlong();
  has_paused_ = !is_first_ && scans_ > options_.most_missing;
  has_stood_ = HasStood(features);
  if (!has_stood_) {
    motion_ = Next();
  }
  untracked_ = 0.0;
  if (goes_along) {
    GoAlong(*step);
  }
  if (carried_ > 0) {
    carried_ += has_paused_ ? options_.max_coasting : 1;
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
  const Cover cover = CoverAt(features, result.registration.T_world_level);
  result.cover = cover.map;
  NoteCover(cover.map);
  if (result.health == LocalizationHealth::kGood &&
      (located.rival || cover.map != MapCover::kFine)) {
    result.health = LocalizationHealth::kWeak;
  }
  // Of a first scan at the edge of the map no motion tells whether it is there.
  const bool is_unchecked = is_first_ && IsAtEdge(features, result.registration.T_world_level);
  Remember(result, Seen(result.registration, cover, located.rival), is_found);
  Keep(features, result, is_found);
  result.covariance = Covariance(result);
  const double up_m = std::sqrt(result.covariance(2, 2));
  if (result.health == LocalizationHealth::kGood &&
      (up_m > options_.max_weak_up_m || is_unchecked)) {
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
  if (lost_ > options_.max_coasting && lost_ % options_.looked_again_after != 0) {
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

PlaceTracker::Cover PlaceTracker::CoverAt(const ScanFeatures& features,
                                          const Pose& T_world_level) const {
  constexpr std::size_t kStride = 4;
  constexpr double kMapped = 0.05;  // of the ground: less is the edge of a map elsewhere
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map_.window().origin()).cast<float>();
  int looked_at = 0;
  int mapped = 0;
  int fine = 0;
  double cells_m = 0.0;
  for (std::size_t i = 0; i < features.ground.size(); i += kStride) {
    const std::optional<int> level = map_.window().LevelAt(R * features.ground[i] + t);
    ++looked_at;
    mapped += level ? 1 : 0;
    fine += level == 0 ? 1 : 0;
    cells_m += level ? cell_size_m_ * (1 << *level) : 0.0;
  }
  if (mapped == 0 || mapped < kMapped * looked_at) {
    return {MapCover::kNone, cell_size_m_};
  }
  return {2 * fine >= mapped ? MapCover::kFine : MapCover::kCoarse, cells_m / mapped};
}

// What the scan says about (x, y, z, yaw); between two places it does not know which.
Eigen::Matrix4d PlaceTracker::Seen(const RegistrationResult& registration,
                                   const Cover& cover,
                                   const std::optional<Eigen::Vector2d>& rival) const {
  Eigen::Matrix4d seen = options_.information_share * PoseInformation(registration.information);
  const double cells =
      cover.map == MapCover::kCoarse ? options_.coarse_sigma_cells : options_.map_sigma_cells;
  const double place_m = std::hypot(options_.map_sigma_m, cells * cover.cell_m);
  const Eigen::Vector4d map_sigmas(place_m, place_m, options_.map_sigma_m, options_.map_sigma_rad);
  const Eigen::Matrix4d map = map_sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  seen -= (seen * (seen + map).inverse() * seen).eval();  // of the sum of both covariances
  if (rival) {
    Eigen::Vector4d towards = Eigen::Vector4d::Zero();
    towards.head<2>() = rival->normalized();
    const Eigen::Matrix4d beside = Eigen::Matrix4d::Identity() - towards * towards.transpose();
    seen = (beside * seen * beside).eval();
  }
  return seen;
}

void PlaceTracker::Remember(const LocalizationResult& result,
                            const Eigen::Matrix4d& seen,
                            bool is_found) {
  const bool is_next = !is_first_ && lost_ == 0 && carried_ == 0;
  is_first_ = false;
  known_ = result.health == LocalizationHealth::kGood ? known_ + 1 : 0;
  was_anywhere_ = was_anywhere_ && known_ < options_.long_known;
  if (result.health == LocalizationHealth::kGood) {
    const double fit = result.registration.fit;
    usual_fit_ = usual_fit_ == 0.0 ? fit : 0.8 * usual_fit_ + 0.2 * fit;
  }
  if (result.health == LocalizationHealth::kLost) {
    motion_.SetTilt(result.T_world_sensor.linear());
    if (carried_ == 0 && ++lost_ > options_.max_coasting) {
      motion_.ForgetMotion();  // looked for where it got to
    }
    return;
  }
  if (carried_ > 0 && !confirmation_.is_confirmed()) {
    motion_.SetTilt(result.T_world_sensor.linear());
    return;
  }
  if (!is_found ||
      LogDensity(Prior(), result.registration.T_world_level) > options_.surprising_log_density) {
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

PlaceTracker::Place PlaceTracker::At(const RegistrationResult& registration, bool has_prior) const {
  const double prior = has_prior ? LogDensity(Prior(), registration.T_world_level) : 0.0;
  return {registration, options_.evidence_share * registration.evidence + prior};
}

void PlaceTracker::SpreadStarts(const PosePrior& prior) {
  starts_.assign(1, prior.T_world_level);
  const HorizontalSpread spread = SpreadOf(prior.covariance);
  if (spread.along_m < options_.fan_sigma_m) {
    return;
  }
  const double reach_m = 2.0 * std::min(spread.along_m, options_.adrift_sigma_m);
  const int steps = static_cast<int>(reach_m / options_.fan_step_m);
  for (int step = -steps; step <= steps; ++step) {
    if (step == 0) {
      continue;  // is the first of all
    }
    starts_.push_back(prior.T_world_level);
    starts_.back().translation().head<2>() += step * options_.fan_step_m * spread.direction;
  }
}

void PlaceTracker::RaiseStarts(const PosePrior& prior, const ScanFeatures& features) {
  DeckFinder surfaces({.reach_m = options_.reachable_up_sigmas * std::sqrt(prior.covariance(2, 2)),
                       .apart_m = options_.told_step_m,
                       .least_m = options_.told_step_m});
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
                                 options_.information_share * prior.covariance};
  SpreadStarts(prior);
  if (is_first_) RaiseStarts(prior, features);
  places_.clear();
  for (const Pose& start : starts_) {
    places_.push_back(
        At(Register(map_.window(), features, start, among_features, options_.registration), true));
  }
  const auto best = std::max_element(places_.begin(), places_.end(), IsLessLikely);
  return {*best, RivalOf(places_, *best)};
}

std::optional<Eigen::Vector2d> PlaceTracker::RivalOf(const std::vector<Place>& places,
                                                     const Place& best) const {
  const Pose& pose = best.registration.T_world_level;
  std::optional<Eigen::Vector2d> rival;
  double likeliest = best.log_likelihood - options_.unique_log_ratio;
  for (const Place& other : places) {
    const Pose& elsewhere = other.registration.T_world_level;
    if (other.log_likelihood > likeliest &&
        AreApart(elsewhere, pose, options_.search.apart_m, options_.search.apart_rad)) {
      likeliest = other.log_likelihood;
      rival = (elsewhere.translation() - pose.translation()).head<2>();
    }
  }
  return rival && rival->norm() > 0.0 ? rival : std::nullopt;
}

}  // namespace atlas
