// What a service that merges sessions is told, and what it takes from the world.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "client/merge/plan/merge_options.h"
#include "client/merge/serve/merge_event.h"
#include "client/merge/serve/merge_limits.h"
#include "core/base/status.h"

namespace atlas {

struct MergeServiceOptions {
  // Without an upload: a session is closed. A vehicle that has no link in a tunnel comes back
  // sooner.
  std::chrono::milliseconds settle{120'000};
  std::chrono::milliseconds every{30'000};  // looks at the daemon, above 0
  // While sessions grow: how long until poses that somebody corrected are noticed. That takes the
  // daemon a look at every keyframe.
  std::chrono::milliseconds recheck{600'000};
  MergeLimits limits;
  MergeOptions merge;
  // Where what merges compute is kept; empty: nowhere. It is in use while one is under way.
  std::filesystem::path work;
  std::uint64_t max_work_bytes = std::uint64_t{16} << 30;
  std::string author;  // of the batches
  // One round and no more: what is staged and not uploaded to for `settle` from its beginning on.
  bool is_once = false;

  // kInvalidArgument names what is none.
  Status Validate() const;
};

struct MergeServiceEnvironment {
  std::function<std::chrono::steady_clock::time_point()> now;
  std::function<void(std::chrono::milliseconds)> sleep;  // less when it is to stop
  std::function<bool()> is_stopping;                     // from any thread
  MergeEvents on_event;
};

}  // namespace atlas
