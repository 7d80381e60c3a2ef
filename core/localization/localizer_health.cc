// How far a localizer's answer can be believed.
#include <cmath>
#include <utility>

#include "core/localization/localizer.h"

namespace atlas {

std::string_view MapCoverName(MapCover cover) {
  switch (cover) {
    case MapCover::kNone:
      return "none";
    case MapCover::kCoarse:
      return "coarse";
    case MapCover::kFine:
      return "fine";
  }
  return "none";
}

std::string_view LocalizationHealthName(LocalizationHealth health) {
  switch (health) {
    case LocalizationHealth::kGood:
      return "good";
    case LocalizationHealth::kWeak:
      return "weak";
    case LocalizationHealth::kLost:
      return "lost";
  }
  return "lost";
}

// What was tracked is: nothing else was found. After scans that were lost the vehicle may be
// anywhere, unless what is seen is what was expected.
bool Localizer::IsExpected(const RegistrationResult& result,
                           const ScanFeatures& features,
                           bool is_found) const {
  if (is_first_ || (lost_ == 0 && !is_found)) {
    return true;
  }
  const PosePrior prior = Prior();
  const Eigen::Vector4d off = PoseDifference(prior.T_world_level, result.T_world_level);
  const bool is_near =
      off.head<3>().norm() <= options_.expected_m && std::abs(off(3)) <= options_.expected_rad;
  const bool is_likely = LogDensity(prior, result.T_world_level) > options_.surprising_log_density;
  return (lost_ == 0 && is_likely) || (lost_ <= options_.max_coasting && is_near &&
                                       confirmation_.IsAsUsual(result, features, usual_fit_));
}

void Localizer::Confirm(const ScanFeatures& features,
                        bool is_expected,
                        LocalizationResult& result) {
  if (result.health == LocalizationHealth::kLost) {
    confirmation_.Miss();
    return;
  }
  if (!is_expected) {
    confirmation_.Doubt();
  }
  const double up_m = result.registration.T_world_level.translation().z();
  if (auto there = confirmation_.Weigh(map_.window(), features, result.registration, usual_fit_,
                                       IsDoubtful(result.registration))) {
    result.registration = *std::move(there);
    motion_.Raise(result.registration.T_world_level.translation().z() - up_m);
  }
  if (!confirmation_.is_confirmed()) {
    result.health = LocalizationHealth::kWeak;
  }
}

LocalizationHealth Localizer::Judge(const RegistrationResult& result,
                                    const ScanFeatures& features,
                                    bool is_expected) const {
  if (!is_expected || !confirmation_.is_confirmed() ? !confirmation_.IsEnough(result, features)
                                                    : result.fit < options_.min_fit) {
    return LocalizationHealth::kLost;
  }
  return WorstSigma(result) > options_.max_weak_sigma_m || result.fit < options_.good_fit
             ? LocalizationHealth::kWeak
             : LocalizationHealth::kGood;
}

// Wider where it is not known that this is the place.
PoseCovariance Localizer::Covariance(const LocalizationResult& result) const {
  const bool is_poor =
      result.health == LocalizationHealth::kWeak && result.registration.fit < options_.good_fit;
  const bool is_known =
      confirmation_.is_confirmed() && !is_poor && lost_ < options_.relocalized_after;
  return is_known ? motion_.covariance() : motion_.covariance() + confirmation_.Spread();
}

}  // namespace atlas
