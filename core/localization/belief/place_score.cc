#include "core/localization/belief/place_score.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace atlas {
namespace {

double WeightOf(std::size_t columns, double many_columns) {
  return std::min(1.0, std::sqrt(static_cast<double>(columns) / many_columns));
}

}  // namespace

double ExplainedShare(const RegistrationResult& registration, const ScanFeatures& features) {
  return registration.evidence /
         static_cast<double>(std::max<std::size_t>(features.columns.size(), 1));
}

double DeckWeight(const ScanFeatures& features, double many_columns) {
  return WeightOf(features.columns.size(), many_columns);
}

double PlaceScore(const RegistrationResult& registration, const ScanFeatures& features) {
  return registration.fit + std::max(0.0, ExplainedShare(registration, features));
}

double CommonLead(std::span<const std::optional<float>> here,
                  std::span<const std::optional<float>> there,
                  double many_columns) {
  // What a column that fits adds to a score, where the map knows of all: to the fit 1, to the share
  // that is explained 1, and the half that would be contradicted.
  constexpr double kOfAScore = 2.5;
  double lead = 0.0;
  std::size_t common = 0;
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (here[i] && there[i]) {
      ++common;
      lead += static_cast<double>(*here[i]) - static_cast<double>(*there[i]);
    }
  }
  return common == 0
             ? 0.0
             : WeightOf(common, many_columns) * kOfAScore * lead / static_cast<double>(common);
}

}  // namespace atlas
