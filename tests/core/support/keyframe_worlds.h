// Small made-up keyframes for tests and benchmarks: flat decks, random grids, street-like scans.
// All deterministic in their seed.
#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <string>

#include "core/fusion/observation/keyframe_placement.h"
#include "core/fusion/tile_fusion.h"
#include "core/geometry/map_profile.h"
#include "core/keyframe/keyframe.h"

namespace atlas::testing {

// A keyframe that saw nothing.
Keyframe BlankKeyframe(const MapProfile& profile, std::int32_t radius_cells);

// Sets all cells of the disc alike.
void FillDisc(Keyframe& keyframe, const KeyframeCell& cell, std::uint64_t column = 0);

// Every cell drawn by itself: all sources, occupancies, altitudes and columns occur.
Keyframe RandomKeyframe(const MapProfile& profile, std::int32_t radius_cells, std::uint32_t seed);

// Ground with noise and a gentle slope under most of the disc, walls, free cells with the columns
// that passing rays leave: about what a front end makes of a street.
Keyframe StreetKeyframe(const MapProfile& profile, std::int32_t radius_cells, std::uint32_t seed);

// A pose on the map: metres and degrees, levelled.
struct MapPose {
  double x_m = 0.0;
  double y_m = 0.0;
  double z_m = 0.0;
  double yaw_deg = 0.0;
};
KeyframePlacement PlaceAt(const MapPose& pose);

struct FrameName {
  std::string vehicle = "car";
  std::string session = "drive";
  std::uint32_t sequence = 0;
};
// At time 100 ms * sequence.
PlacedKeyframe PlacedFrame(const FrameName& name, const MapPose& pose, Keyframe keyframe);

}  // namespace atlas::testing
