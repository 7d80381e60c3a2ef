// What travels to a vehicle that holds the map when some of it changed: as differences, and what
// the changed tiles are as a whole.
#pragma once

#include <cstdint>
#include <string>

#include "client/connection/endpoint.h"
#include "core/base/status.h"
#include "core/geometry/map_area.h"

namespace atlas::testing {

struct StoreUpdate {
  std::uint64_t tiles = 0;        // that changed
  std::uint64_t deltas = 0;       // of these, sent as differences
  std::uint64_t bytes = 0;        // of the replies that brought them
  std::uint64_t whole_bytes = 0;  // of the replies that bring the same tiles to who holds nothing
};

// Brings the store in the folder up to date, then asks for what changed once more.
Result<StoreUpdate> UpdateStore(const Endpoint& daemon,
                                const BoxArea& area,
                                const std::string& folder);

}  // namespace atlas::testing
