// What a daemon of that profile says to the calls of fuzz_reply.cc, one after the other.
#pragma once

#include <vector>

#include "core/geometry/map_profile.h"
#include "proto/wire/envelope.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {

// The tile that the client holds: TileSeeds()[0].
struct HeldSeed {
  std::uint64_t key = 0;
  std::uint64_t payload_hash = 0;
  Bytes blob;
};
HeldSeed HeldTileSeed();

// The reply to the Hello has the id 1, that to the sync 2, and so on.
std::vector<wire::Envelope> ReplySeeds();

}  // namespace atlas::fuzz
