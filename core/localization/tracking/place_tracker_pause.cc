// A pause in the times: the vehicle may have gone on, or stood meanwhile (decision 0631).
#include <limits>
#include <optional>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {

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
