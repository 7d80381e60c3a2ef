#include "client/score/localization_score.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace atlas {
namespace {

constexpr double kMaxTranslation_m = 1.0;
constexpr double kMaxRotation_deg = 5.0;

}  // namespace

PoseError ErrorOf(const Pose& estimate, const Pose& truth) {
  const Eigen::Quaterniond a(estimate.linear());
  const Eigen::Quaterniond b(truth.linear());
  return {(estimate.translation() - truth.translation()).norm(),
          a.angularDistance(b) * 180.0 / std::numbers::pi};
}

bool IsFailure(const PoseError& error, bool is_lost) {
  return is_lost ||
         !(error.translation_m <= kMaxTranslation_m && error.rotation_deg <= kMaxRotation_deg);
}

void LocalizationScore::Add(const PoseError& error, bool is_lost) {
  ++shots_;
  lost_ += is_lost ? 1U : 0U;
  if (IsFailure(error, is_lost)) {
    ++failures_;
    return;
  }
  translations_m_.push_back(error.translation_m);
  rotation_square_sum_ += error.rotation_deg * error.rotation_deg;
}

double LocalizationScore::translation_rmse_m() const {
  if (translations_m_.empty()) return 0.0;
  double sum = 0.0;
  for (const double error_m : translations_m_) {
    sum += error_m * error_m;
  }
  return std::sqrt(sum / static_cast<double>(translations_m_.size()));
}

double LocalizationScore::rotation_rmse_deg() const {
  if (translations_m_.empty()) return 0.0;
  return std::sqrt(rotation_square_sum_ / static_cast<double>(translations_m_.size()));
}

double LocalizationScore::translation_p95_m() const {
  if (translations_m_.empty()) return 0.0;
  std::vector<double> sorted = translations_m_;
  const std::size_t rank = (95 * sorted.size() + 99) / 100 - 1;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}

}  // namespace atlas
