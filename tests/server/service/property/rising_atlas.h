// Draws an atlas of ground that rises under a vehicle that comes nearer, while others guess where
// it is: the layer, the mean of what was seen, stays behind, so that a small change can reach far
// up and down a cell. Compared after nearly every upload, by daemons that keep all they know.
#pragma once

#include <cstdint>

#include "tests/server/service/property/atlas_script.h"

namespace atlas::testing {

// The same for the same seed, everywhere.
AtlasScript RisingAtlas(std::uint32_t seed);

}  // namespace atlas::testing
