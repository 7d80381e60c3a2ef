// The other surfaces of the map above and below a place: a garage looks much the same from each.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/pose.h"
#include "core/localization/scan_features.h"
#include "core/localization/window/map_window.h"

namespace atlas {

struct DeckOptions {
  double reach_m = 12.0;        // looked for so far above and below
  double apart_m = 1.5;         // surfaces closer than this are one
  float near_m = 12.0F;         // of the scan's ground: what lies so near the sensor
  std::size_t min_ground = 10;  // features of it; fewer say nothing
  double min_share = 0.3;       // of these that a deck has to carry
  std::size_t most = 4;
};

// How far up (metres, down is negative) the scan would lie on another surface, the one that carries
// most of its ground first. `T_world_level` is where it is taken to be.
std::vector<double> OtherDecks(const MapWindow& map,
                               const ScanFeatures& features,
                               const Pose& T_world_level,
                               const DeckOptions& options);

}  // namespace atlas
