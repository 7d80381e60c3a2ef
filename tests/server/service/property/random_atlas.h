// Draws what happens to an atlas: some sessions of some vehicles on several decks over a few tiles,
// and a life of uploads, corrections, retractions and restarts.
#pragma once

#include <cstdint>

#include "tests/server/service/property/atlas_script.h"

namespace atlas::testing {

// The same for the same seed, everywhere.
AtlasScript RandomAtlas(std::uint32_t seed);

}  // namespace atlas::testing
