// Why an atlas has no map, told to who wants to use one.
#pragma once

#include <cstdint>
#include <span>

#include "client/connection/requests.h"
#include "core/base/status.h"

namespace atlas {

// What is known of an atlas without a tile.
struct MissingMap {
  std::uint64_t dirty_tiles = 0;  // that wait to be fused for the first time
  std::span<const SessionSummary> sessions;
  bool is_file = false;  // nobody fuses its tiles as long as no daemon runs on it
};

// kNotFound. The message says whether nothing was uploaded, is fused yet or is in the map, and
// which command changes that.
Status MissingMapStatus(const MissingMap& missing);

}  // namespace atlas
