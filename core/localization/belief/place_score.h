// How well a scan fits a place, as places are compared.
#pragma once

#include <optional>
#include <span>

#include "core/localization/registration/registration.h"
#include "core/localization/registration/scan_features.h"

namespace atlas {

// Share of the scan's columns that the map explains there, less contradictions.
double ExplainedShare(const RegistrationResult& registration, const ScanFeatures& features);
// A scan of fewer columns tells decks apart as badly as the error of a mean over them says: four
// rings in a garage have 600, sixteen 2,300 and more (decision 0629).
inline constexpr double kManyColumns = 2'000.0;
// How much a scan counts then, 0..1.
double DeckWeight(const ScanFeatures& features, double many_columns);
// By which places are compared. A deck that was mapped better explains more; the right one is
// contradicted less.
double PlaceScore(const RegistrationResult& registration, const ScanFeatures& features);
// How much better a scan fits one place than another by the columns of which the map knows
// something at both (FeatureFit::ColumnWeights), on the scale of PlaceScore, and less the fewer
// these are: near the edge of the map a place explains little of a scan, right as it may be.
double CommonLead(std::span<const std::optional<float>> here,
                  std::span<const std::optional<float>> there,
                  double many_columns);

}  // namespace atlas
