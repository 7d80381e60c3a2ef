// What one name, or one address without one, may take of what all share: places of those who wait,
// watches and their areas, bytes of replies a second. Thread-safe.
#pragma once

#include <cstddef>
#include <string>
#include <utility>

#include "server/net/byte_budget.h"
#include "server/net/net_options.h"
#include "server/net/places.h"
#include "server/net/served_rate.h"

namespace atlas {

struct PeerShare {
  PeerShare(std::string name, const NameLimits& limits)
      : whose(std::move(name)),
        waits(limits.waits),
        works(limits.waits),
        watches(limits.watches),
        watched(limits.watched_bytes),
        served(limits.served_bytes_per_s) {}

  const std::string whose;  // for messages
  Places waits;
  Places works;  // digests and the like
  Places watches;
  ByteBudget watched;
  ServedRate served;
};

}  // namespace atlas
