// What all connections share of the daemon's memory, and who has how much of it. Thread-safe.
#pragma once

#include "server/net/byte_budget.h"
#include "server/net/connection/identity_limits.h"
#include "server/net/connection/large_parts.h"
#include "server/net/net_options.h"

namespace atlas {

struct SharedLimits {
  explicit SharedLimits(const NetOptions& options)
      : held(options.max_held_bytes),
        queued(options.max_all_queued_bytes),
        large(options.max_held_bytes / 2),
        identities(options.of_name) {}

  ByteBudget held;    // requests and parts of them
  ByteBudget queued;  // replies that wait for slow readers
  LargeParts large;   // of `held`, what waits for the rest of large requests
  IdentityLimits identities;
};

}  // namespace atlas
