// Where the map ends around a vehicle.
#pragma once

#include <optional>

#include "core/geometry/pose.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/window/map_window.h"

namespace atlas {

// Share of the scan's ground within 15 m of the vehicle that is in the map at its height; none
// where no ground is seen. Along drives through maps that go on it is 0.7 to 0.95, at the edge of
// one of half a deck 0.65 to 0.3.
std::optional<double> GroundMapped(const MapWindow& map,
                                   const ScanFeatures& features,
                                   const Pose& T_world_level);
// Whether so little is that the map ends here.
bool IsAtEdge(const MapWindow& map, const ScanFeatures& features, const Pose& T_world_level);

}  // namespace atlas
