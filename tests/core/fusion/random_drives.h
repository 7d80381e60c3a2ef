// Random sets of keyframes for property tests: as hard for fusion as they can be made.
#pragma once

#include <cstdint>
#include <vector>

#include "core/fusion/tile_fusion.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {

// Tiles of 16 cells, stretches of 16; all column sizes and both of the product's presets occur.
MapProfile DrivesProfile(std::uint32_t seed);

// Some sessions of some vehicles on several decks around tile 0/0/0, in random order, with gaps in
// their sequences and times that do not always follow them.
std::vector<PlacedKeyframe> RandomDrives(const MapProfile& profile, std::uint32_t seed);

}  // namespace atlas::testing
