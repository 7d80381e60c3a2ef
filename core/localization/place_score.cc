#include "core/localization/place_score.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace atlas {

double ExplainedShare(const RegistrationResult& registration, const ScanFeatures& features) {
  return registration.evidence /
         static_cast<double>(std::max<std::size_t>(features.columns.size(), 1));
}

double DeckWeight(const ScanFeatures& features, double many_columns) {
  return std::min(1.0, std::sqrt(static_cast<double>(features.columns.size()) / many_columns));
}

double PlaceScore(const RegistrationResult& registration, const ScanFeatures& features) {
  return registration.fit + std::max(0.0, ExplainedShare(registration, features));
}

}  // namespace atlas
