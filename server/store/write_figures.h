// What the writer of a store did, for whoever watches it.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "core/base/status.h"
#include "server/base/duration_histogram.h"

namespace atlas {

// The disk, or the length of the queue, kept a write from being done.
struct WriteRefusal {
  Status why;
  std::chrono::steady_clock::time_point when;
};

struct WriteFigures {
  std::uint64_t queued = 0;  // operations that wait now
  DurationFigures commits;   // transactions that changed something, begin to disk
  std::optional<WriteRefusal> last_refusal;
};

}  // namespace atlas
