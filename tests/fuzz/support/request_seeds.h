// A request of each kind to an atlas of this profile, as clients send them.
#pragma once

#include "core/geometry/map_profile.h"
#include "proto/wire/envelope.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {

// The requests' ids are 2, 3 and so on; the Hello is not among them.
std::vector<wire::Envelope> RequestSeeds(const MapProfile& profile);
wire::Envelope HelloSeed(const MapProfile& profile);

}  // namespace atlas::fuzz
