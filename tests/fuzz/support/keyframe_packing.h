// Keyframe blobs in the clear: the header's fields, then the body.
#pragma once

#include "core/geometry/map_profile.h"
#include "tests/fuzz/support/packed_mutator.h"

namespace atlas::fuzz {

Packing KeyframePacking();
// Small ones, of all sources and occupancies and of a street, for this profile.
std::vector<Bytes> KeyframeSeeds(const MapProfile& profile);

}  // namespace atlas::fuzz
