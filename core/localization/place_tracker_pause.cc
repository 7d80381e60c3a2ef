// A pause in the times: the vehicle may have gone on, or stood meanwhile (decision 0631).
#include <limits>
#include <optional>

#include "core/localization/place_tracker.h"

namespace atlas {

bool PlaceTracker::HasStood(const ScanFeatures& features) {
  if (is_first_ || lost_ > 0 || scans_ <= options_.most_missing) {
    return false;
  }
  MotionModel stood = motion_;
  stood.ForgetMotion();
  stood.Predict();
  MotionModel stopped = motion_;  // and went on as before
  stopped.Predict();
  constexpr double kNone = -std::numeric_limits<double>::max();
  bool has_stood = scans_ > options_.most_predicted;
  double asked = LikelihoodNear(has_stood ? stood : Next(), features).value_or(kNone) +
                 options_.believed_log_ratio;
  if (has_stood) motion_ = stood;
  for (const MotionModel& model : {stood, stopped}) {
    const std::optional<double> likelihood = LikelihoodNear(model, features);
    if (likelihood && *likelihood > asked) {
      asked = *likelihood;
      motion_ = model;
      has_stood = true;
    }
  }
  return has_stood;
}

std::optional<double> PlaceTracker::LikelihoodNear(const MotionModel& model,
                                                   const ScanFeatures& features) const {
  const PosePrior prior = PriorOf(model);
  if (carried_ > 0) {
    const PosePrior step{prior.T_world_level, model.StepCovariance()};
    const ScanMotion moved = trail_.MotionTo(features, step);
    return trail_.IsKnown(moved) ? std::optional(moved.fit) : std::nullopt;
  }
  const RegistrationResult here =
      Register(map_.window(), features, prior.T_world_level, prior, options_.registration);
  return confirmation_.IsAsUsual(here, features, usual_fit_)
             ? std::optional(At(here, false).log_likelihood)
             : std::nullopt;
}

}  // namespace atlas
