#include "core/localization/localizer.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/geometry/motion_share.h"
#include "core/localization/belief/place_score.h"
#include "core/scan/deskew.h"

namespace atlas {
namespace {

// During a revolution: less moves returns at 20 m by 5 cm at most.
bool IsFelt(const Pose& motion) {
  constexpr double kLeast_m = 0.05;
  constexpr double kLeast_rad = 0.005;
  return motion.translation().norm() > kLeast_m ||
         Eigen::AngleAxisd(motion.linear()).angle() > kLeast_rad;
}

// How far is looked, and there was anything to see.
double ReachOf(const LeveledScan& scan, float max_range_m) {
  const auto furthest = std::max_element(scan.range_m.begin(), scan.range_m.end());
  return furthest == scan.range_m.end() ? 0.0F : std::min(*furthest, max_range_m);
}

}  // namespace

Localizer::Localizer(const MapProfile& profile,
                     TilesAround tiles,
                     const LocalizerOptions& options,
                     RelocalizerSource relocalizer)
    : profile_(profile),
      tiles_(std::move(tiles)),
      options_(options),
      features_(options.features),
      relocalizer_(std::move(relocalizer)),
      own_motion_(options.tracker.motion, options.tracker.pause, options.tracker.trail.odometry) {
  places_.emplace_back(NewTracker());
}

PlaceTracker Localizer::NewTracker() const {
  return {profile_, tiles_, options_.tracker, static_cast<double>(options_.features.max_range_m)};
}

void Localizer::Start(const Pose& T_world_sensor, const StartKnowledge& known) {
  places_.erase(places_.begin() + 1, places_.end());
  places_.front().tracker.Start(T_world_sensor, known);
  astray_ = 0;
  own_motion_.Forget();
  scans_ = 0.0;
}

Result<LocalizationResult> Localizer::Localize(const LeveledScan& scan,
                                               const Eigen::Quaterniond& R_level_sensor,
                                               double scans) {
  if (Status status = Expect(scan, R_level_sensor, scans); !status.ok()) {
    return Error(std::move(status));
  }
  return Find(scan, R_level_sensor);
}

Result<LocalizationResult> Localizer::LocalizeDeskewed(LeveledScan& scan,
                                                       const Eigen::Quaterniond& R_level_sensor,
                                                       double scans,
                                                       double revolutions) {
  if (Status status = Expect(scan, R_level_sensor, scans); !status.ok()) {
    return Error(std::move(status));
  }
  Sharpen(scan, R_level_sensor, revolutions);
  return Find(scan, R_level_sensor);
}

void Localizer::Sharpen(LeveledScan& scan,
                        const Eigen::Quaterniond& R_level_sensor,
                        double revolutions) {
  constexpr int kTimes = 3;
  PlaceTracker& tracker = places_.front().tracker;
  Pose taken = tracker.T_now_later();
  auto seen = tracker.MotionSeen(features_.Extract(scan));
  for (int time = 0; seen && time < kTimes; ++time) {
    const Pose rest = ShareOf(taken.inverse() * seen->T_now_later, 1.0 / revolutions);
    if (!IsFelt(rest)) return;
    deskewed_ = scan;
    Deskew(deskewed_, R_level_sensor, rest);
    const auto better = tracker.MotionSeen(features_.Extract(deskewed_));
    if (!better || better->fit <= seen->fit) return;
    std::swap(scan, deskewed_);
    taken = seen->T_now_later;
    seen = better;
  }
}

Status Localizer::Expect(const LeveledScan& scan,
                         const Eigen::Quaterniond& R_level_sensor,
                         double scans) {
  for (SupposedPlace& place : places_) place.tracker.Expect(scans);
  scans_ += scans;
  std::vector<SupposedPlace> found;
  if (IsLookedFor()) {
    auto looked = Look(scan, R_level_sensor);
    if (!looked) return looked.error();
    found = *std::move(looked);
  }
  for (std::vector<SupposedPlace>* places : {&places_, &found}) {
    for (SupposedPlace& place : *places) {
      ATLAS_RETURN_IF_ERROR(place.tracker.Prepare());
    }
  }
  for (SupposedPlace& place : found) {
    place.number = ++supposed_;
    places_.push_back(std::move(place));
  }
  return {};
}

LocalizationResult Localizer::Find(const LeveledScan& scan,
                                   const Eigen::Quaterniond& R_level_sensor) {
  Follow(features_.Extract(scan), R_level_sensor);
  LocalizationResult result = places_.front().result;
  const double reach_m = ReachOf(scan, options_.features.max_range_m);
  if (reach_m < options_.min_good_reach_m && result.health == LocalizationHealth::kGood) {
    result.health = LocalizationHealth::kWeak;
  }
  return result;
}

bool Localizer::IsLookedFor() const {
  const int since = astray_ - options_.looked_after;
  const PlaceTracker& told = places_.front().tracker;
  const bool was_known = told.usual_fit() > 0.0;
  if (told.is_carried() && was_known && told.reach_m() < options_.adrift_m) {
    return false;
  }
  return relocalizer_ && since >= 0 && since % options_.looked_again_after == 0;
}

Result<std::vector<Localizer::SupposedPlace>> Localizer::Look(
    const LeveledScan& scan, const Eigen::Quaterniond& R_level_sensor) const {
  std::vector<SupposedPlace> places;
  const auto relocalizer = relocalizer_();
  if (!relocalizer) return Error(relocalizer.error());
  if (*relocalizer == nullptr) {
    return places;
  }
  const auto looked = (*relocalizer)->Find(scan, R_level_sensor, places_.front().tracker.Within());
  if (!looked) return Error(looked.error());
  const double usual_fit = places_.front().tracker.usual_fit();
  for (const RelocalizedPlace& place : looked->places) {
    const double best = looked->places.front().score;
    if (places.size() == options_.most_places ||
        place.score < std::max(options_.min_found_score, best - options_.max_behind)) {
      break;
    }
    Pose T_world_sensor = place.registration.T_world_level;
    T_world_sensor.linear() *= R_level_sensor.toRotationMatrix();
    if (IsFollowed(T_world_sensor) || !places_.front().tracker.IsReachable(T_world_sensor)) {
      continue;
    }
    places.emplace_back(NewTracker());
    places.back().tracker.Suppose(T_world_sensor, usual_fit);
  }
  return places;
}

bool Localizer::IsFollowed(const Pose& T_world_sensor) const {
  return std::any_of(places_.begin(), places_.end(), [&](const SupposedPlace& place) {
    return place.lost == 0 && !AreApart(place.tracker.T_world_expected(), T_world_sensor,
                                        options_.same_m, options_.same_rad);
  });
}

void Localizer::Follow(const ScanFeatures& features, const Eigen::Quaterniond& R_level_sensor) {
  if (places_.size() == 1) places_.front().scores.clear();
  std::erase_if(leads_, [&](const auto& lead) { return !IsThere(lead.first); });
  const std::optional<OwnStep> step = StepOf(features);
  for (SupposedPlace& place : places_) {
    place.result = place.tracker.Track(features, R_level_sensor, step);
    place.lost = place.result.health == LocalizationHealth::kLost ? place.lost + 1 : 0;
  }
  if (places_.size() > 1) Note(features);
  Join();
  GiveUp();
  Choose();
  const SupposedPlace& told = places_.front();
  const bool is_astray = places_.size() > 1 || told.lost > 0 || !told.tracker.is_confirmed() ||
                         told.tracker.spread_m() > options_.adrift_m ||
                         told.tracker.is_just_found();
  astray_ = is_astray ? astray_ + 1 : 0;
  if (!is_astray && !told.tracker.GoesAlong()) {
    own_motion_.Forget();
  } else if (!step) {
    own_motion_.Begin(features);
  }
}

std::optional<OwnStep> Localizer::StepOf(const ScanFeatures& features) {
  const double scans = std::exchange(scans_, 0.0);
  const bool is_needed =
      std::any_of(places_.begin(), places_.end(),
                  [](const SupposedPlace& place) { return place.tracker.GoesAlong(); });
  return is_needed && own_motion_.is_begun() ? std::optional(own_motion_.Next(features, scans))
                                             : std::nullopt;
}

void Localizer::Note(const ScanFeatures& features) {
  for (SupposedPlace& place : places_) {
    if (place.scores.size() == options_.most_scores) place.scores.erase(place.scores.begin());
    place.scores.push_back(PlaceScore(place.result.registration, features));
    place.is_at_edge = place.tracker.IsAtEdge(features, place.result.registration.T_world_level);
    place.tracker.ColumnWeights(features, place.result.registration.T_world_level, place.weights);
  }
  const auto columns = static_cast<double>(features.columns.size());
  for (const SupposedPlace& place : places_) {
    for (const SupposedPlace& other : places_) {
      if (&place == &other) continue;
      Lead& lead = leads_[{place.number, other.number}];
      const double by_all = place.scores.back() - other.scores.back();
      lead.by_all += by_all;
      lead.by_common += place.lost > 0 || other.lost > 0
                            ? by_all
                            : CommonLead(place.weights, other.weights, columns);
      ++lead.scans;
    }
  }
}

void Localizer::Join() {
  for (std::size_t i = 1; i < places_.size();) {
    const auto same = std::find_if(
        places_.begin(), places_.begin() + static_cast<std::ptrdiff_t>(i),
        [&](const SupposedPlace& other) {
          return other.lost == 0 && places_[i].lost == 0 &&
                 IsSamePlace(other.result.T_world_sensor, places_[i].result.T_world_sensor,
                             options_.tracker.hypotheses);
        });
    if (same == places_.begin() + static_cast<std::ptrdiff_t>(i)) {
      ++i;
      continue;
    }
    if (IsBetter(places_[i], *same)) std::swap(*same, places_[i]);
    places_.erase(places_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

// One that is carried knows where the vehicle cannot be, whatever it scored on its way.
bool Localizer::IsBetter(const SupposedPlace& a, const SupposedPlace& b) const {
  const auto rank = [](const SupposedPlace& place) {
    return std::pair(place.tracker.is_confirmed(), place.tracker.is_carried());
  };
  return rank(a) != rank(b) ? rank(a) > rank(b) : LeadOver(a, b).by_all > 0.0;
}

void Localizer::GiveUp() {
  for (std::size_t i = places_.size() - 1; i > 0; --i) {
    if (IsGivenUp(places_[i])) places_.erase(places_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  while (places_.size() > options_.most_places) {
    places_.erase(std::min_element(places_.begin() + 1, places_.end(),
                                   [](const SupposedPlace& a, const SupposedPlace& b) {
                                     return a.scores.back() < b.scores.back();
                                   }));
  }
}

bool Localizer::IsGivenUp(const SupposedPlace& place) const {
  if (place.lost > options_.most_lost ||
      !places_.front().tracker.IsReachable(place.result.T_world_sensor)) {
    return true;
  }
  return std::any_of(places_.begin(), places_.end(), [&](const SupposedPlace& other) {
    const Lead lead = LeadOver(other, place);
    return lead.scans >= options_.lead.scans &&
           SumOf(lead, place) > options_.max_behind * lead.scans;
  });
}

bool Localizer::IsThere(const std::pair<int, int>& numbers) const {
  const auto is_one = [&](int number) {
    return std::any_of(places_.begin(), places_.end(),
                       [&](const SupposedPlace& place) { return place.number == number; });
  };
  return is_one(numbers.first) && is_one(numbers.second);
}

Localizer::Lead Localizer::LeadOver(const SupposedPlace& place, const SupposedPlace& other) const {
  const auto lead = leads_.find({place.number, other.number});
  return lead == leads_.end() ? Lead() : lead->second;
}

// Where it was tracked to is one of all places only while there are others; where it was tracked
// from scan to scan it is, unless another is ahead.
bool Localizer::IsBelieved(const SupposedPlace& place) const {
  const double sum = std::accumulate(place.scores.begin(), place.scores.end(), 0.0);
  return place.lost == 0 && place.tracker.is_confirmed() && IsAhead(place) &&
         sum >= options_.min_score * static_cast<double>(place.scores.size());
}

bool Localizer::IsAhead(const SupposedPlace& place) const {
  const bool is_tracked_on = &place == &places_.front() && place.tracker.is_tracked_on();
  return std::all_of(places_.begin(), places_.end(), [&](const SupposedPlace& other) {
    if (&other == &place) {
      return true;
    }
    const Lead lead = LeadOver(place, other);
    const Lead behind = LeadOver(other, place);
    return is_tracked_on ? !options_.lead.IsClear(behind.by_both(), behind.scans)
                         : options_.lead.IsClear(SumOf(lead, other), lead.scans);
  });
}

double Localizer::SumOf(const Lead& lead, const SupposedPlace& other) const {
  const bool is_known =
      &other == &places_.front() && other.lost == 0 && other.tracker.is_confirmed();
  return is_known || other.is_at_edge ? lead.by_both() : lead.by_all;
}

void Localizer::Choose() {
  if (places_.size() == 1) {
    return;
  }
  const auto believed = std::find_if(places_.begin(), places_.end(),
                                     [&](const SupposedPlace& place) { return IsBelieved(place); });
  if (believed == places_.end()) {
    LocalizationResult& told = places_.front().result;
    told = places_.front().tracker.Doubted(told);
    return;
  }
  std::swap(*believed, places_.front());
  places_.erase(places_.begin() + 1, places_.end());
  places_.front().tracker.Settle();
}

}  // namespace atlas
