// What a service that merges sessions tells of itself, for a log and for reports.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/connection/requests.h"
#include "client/merge/merge_run.h"
#include "client/merge/serve/merge_limits.h"
#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

enum class MergeEventKind : std::uint8_t {
  kConnected,   // to a daemon: after the start, or after kLost
  kLost,        // `status`: the daemon is not reached; once until it is again
  kBegun,       // `sessions` are read and merged
  kGoesOn,      // `step`, `done`, `all`: now and then while it computes
  kNothing,     // `run`: none of its staged sessions belongs anywhere, nothing was applied
  kApplied,     // `run`, `batch`
  kOverLimits,  // `run`, `breaches`: not applied
  kFailed,      // `status`: `sessions` cannot be merged
  kSplit,       // `sessions` went over limits or failed together: smaller groups are tried
  kPutOff,      // `status`: what was begun is done again later, after a conflict or a broken link
};

// What the kind does not have is empty.
struct MergeEvent {
  MergeEventKind kind;
  std::vector<SessionKey> sessions = {};  // staged, as they were asked for
  const MergeRun* run = nullptr;          // during the call
  std::optional<PoseBatchSummary> batch = std::nullopt;
  std::vector<LimitBreach> breaches = {};
  Status status = {};
  std::string_view step = {};
  std::size_t done = 0;
  std::size_t all = 0;
};

// Called from the service's thread, kGoesOn from any, one call at a time.
using MergeEvents = std::function<void(const MergeEvent&)>;

}  // namespace atlas
