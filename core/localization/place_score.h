// How well a scan fits a place, as places are compared.
#pragma once

#include "core/localization/registration.h"
#include "core/localization/scan_features.h"

namespace atlas {

// Share of the scan's columns that the map explains there, less contradictions.
double ExplainedShare(const RegistrationResult& registration, const ScanFeatures& features);
// By which places are compared. A deck that was mapped better explains more; the right one is
// contradicted less.
double PlaceScore(const RegistrationResult& registration, const ScanFeatures& features);

}  // namespace atlas
