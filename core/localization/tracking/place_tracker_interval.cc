// How long ago the last scan was. Times may be wrong: tried are the told one, one interval and the
// nearest whole number of them (decision 0637). In a pause the vehicle may have gone on, or stood
// meanwhile (decision 0631).
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {

std::array<double, 2> PlaceTracker::WholeIntervals() const {
  return {1.0, std::max(1.0, std::round(scans_))};
}

MotionModel PlaceTracker::Arrived(const ScanFeatures& features) {
  MotionModel told = Next();
  if (is_first_ || lost_ > 0 || scans_ > options_.pause.most_missing) {
    return told;
  }
  if (!IsSpeedKnown()) {
    return After(WholeIntervals().back());
  }
  std::optional<Arrival> likeliest;
  Thin(features, thinned_);
  double tried = 0.0;
  for (const double scans : WholeIntervals()) {
    if (scans == std::exchange(tried, scans)) continue;  // the nearest whole number is one
    MotionModel other = After(scans);
    const MotionModel& arrived = likeliest ? likeliest->motion : told;
    if (!AreApart(arrived.T_world_sensor(), other.T_world_sensor(), options_.pause.apart_m,
                  options_.pause.apart_rad)) {
      continue;
    }
    if (!likeliest) likeliest = ArrivalBy(told, scans_, thinned_);
    Arrival arrival = ArrivalBy(other, scans, thinned_);
    if (IsLikelier(arrival, *likeliest)) likeliest = std::move(arrival);
  }
  return likeliest ? likeliest->motion : told;
}

MotionModel PlaceTracker::After(double scans) const {
  MotionModel later = motion_;
  later.Predict(scans);
  return later;
}

PlaceTracker::Arrival PlaceTracker::ArrivalBy(const MotionModel& motion,
                                              double scans,
                                              const ScanFeatures& features) const {
  const PosePrior prior = PriorOf(motion);
  Arrival arrival{motion, Pose::Identity(), 0.0, 0.0, LogOddsOf(scans)};
  if (carried_ > 0) {
    constexpr double kOfFit = 200.0;  // fits that differ by as_good_fit count 10
    const ScanMotion moved =
        trail_.MotionTo(features, {prior.T_world_level, motion.StepCovariance()});
    arrival.T_world_level = moved.T_world_level;
    arrival.log_likelihood = trail_.IsKnown(moved) ? kOfFit * moved.fit : 0.0;
  } else {
    const PosePrior among_features{prior.T_world_level,
                                   options_.seen.information_share * prior.covariance};
    const RegistrationResult here = Register(map_.window(), features, prior.T_world_level,
                                             among_features, options_.registration);
    arrival.T_world_level = here.T_world_level;
    arrival.log_likelihood = options_.hypotheses.evidence_share * here.evidence;
  }
  arrival.log_expected = LogExpected(prior.T_world_level, arrival.T_world_level);
  return arrival;
}

// Sensors turn evenly: a told time that is no whole number errs by as much as it is off the nearest
// one, another interval by as much as it is off the told time.
double PlaceTracker::LogOddsOf(double scans) const {
  const double whole = WholeIntervals().back();
  const double errs = (scans_ - (scans == scans_ ? whole : scans)) / options_.pause.sigma;
  return scans == whole ? 0.0 : -0.5 * errs * errs;
}

double PlaceTracker::LogExpected(const Pose& expected, const Pose& found) const {
  const PauseOptions& pause = options_.pause;
  const Eigen::Vector4d sigmas(pause.off_m, pause.off_m, pause.off_m, pause.off_rad);
  return -0.5 * PoseDifference(expected, found).cwiseQuotient(sigmas).squaredNorm();
}

bool PlaceTracker::IsLikelier(const Arrival& a, const Arrival& b) const {
  if (!AreApart(a.T_world_level, b.T_world_level, options_.pause.apart_m,
                options_.pause.apart_rad)) {
    return a.log_expected + a.log_odds > b.log_expected + b.log_odds;
  }
  const auto log_of = [&](const Arrival& arrival) {
    return arrival.log_likelihood + arrival.log_odds +
           LogDensity(PriorOf(arrival.motion), arrival.T_world_level);
  };
  return log_of(a) > log_of(b);
}

void PlaceTracker::ArriveAt(const Pose& T_world_level, const MotionModel& before) {
  if (is_first_ || lost_ > 0 || scans_ > options_.pause.most_missing) {
    return;
  }
  double likeliest = -std::numeric_limits<double>::max();
  for (const double scans : {scans_, 1.0, WholeIntervals().back()}) {
    MotionModel other = before;
    other.Predict(scans);
    const double log = LogExpected(PriorOf(other).T_world_level, T_world_level) + LogOddsOf(scans);
    if (log > likeliest) {
      likeliest = log;
      motion_ = other;
    }
  }
}

bool PlaceTracker::IsSpeedKnown() const {
  return SpreadOf(motion_.MotionCovariance()).along_m <= options_.pause.known_m;
}

bool PlaceTracker::HasStood(const ScanFeatures& features) {
  if (lost_ > 0 || !at_hand_.has_paused) {
    return false;
  }
  MotionModel stood = motion_;
  stood.ForgetMotion();
  stood.Predict();
  MotionModel stopped = motion_;  // and went on as before
  stopped.Predict();
  constexpr double kNone = -std::numeric_limits<double>::max();
  const Pose last = LevelFrame(motion_.T_world_sensor());
  const bool is_by_trail = carried_ > 0 || (!trail_.is_empty() && IsAtEdge(features, last));
  const auto likelihood_near = [&](const MotionModel& model) {
    return is_by_trail ? FitOnTrail(model, features) : LikelihoodNear(model, features);
  };
  bool has_stood = scans_ > options_.pause.most_predicted;
  double asked =
      likelihood_near(has_stood ? stood : Next()).value_or(kNone) +
      (is_by_trail ? -options_.trail.odometry.as_good_fit : options_.hypotheses.believed_log_ratio);
  if (has_stood) motion_ = stood;
  for (const MotionModel& model : {stood, stopped}) {
    const std::optional<double> likelihood = likelihood_near(model);
    if (likelihood && *likelihood > asked) {
      asked = *likelihood;
      motion_ = model;
      has_stood = true;
    }
  }
  return has_stood;
}

std::optional<double> PlaceTracker::FitOnTrail(const MotionModel& model,
                                               const ScanFeatures& features) const {
  const PosePrior step{PriorOf(model).T_world_level, model.StepCovariance()};
  const ScanMotion moved = trail_.MotionTo(features, step);
  return trail_.IsKnown(moved) ? std::optional(moved.fit) : std::nullopt;
}

std::optional<double> PlaceTracker::LikelihoodNear(const MotionModel& model,
                                                   const ScanFeatures& features) const {
  const PosePrior prior = PriorOf(model);
  const RegistrationResult here =
      Register(map_.window(), features, prior.T_world_level, prior, options_.registration);
  return confirmation_.IsAsUsual(here, features, usual_fit_)
             ? std::optional(At(here, false).log_likelihood)
             : std::nullopt;
}

}  // namespace atlas
