#include "core/localization/place_score.h"

#include <algorithm>
#include <cstddef>

namespace atlas {

double ExplainedShare(const RegistrationResult& registration, const ScanFeatures& features) {
  return registration.evidence /
         static_cast<double>(std::max<std::size_t>(features.columns.size(), 1));
}

double PlaceScore(const RegistrationResult& registration, const ScanFeatures& features) {
  return registration.fit + std::max(0.0, ExplainedShare(registration, features));
}

}  // namespace atlas
