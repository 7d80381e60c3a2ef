// How much of an upload an earlier run of it left with the daemon, by what the daemon tells of the
// sessions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client/connection/requests.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

struct PlannedKeyframe {
  KeyframeKey key;
  std::int64_t time_ms = 0;
};

// So many of those that are there are sent once more, and answered before any that is not: other
// content under their keys is refused, where the first run was one with other options.
inline constexpr std::size_t kSentTwice = 8;

// Which of ours have the last sequence number of a session that is there: it has that one, whoever
// uploaded it.
std::vector<std::size_t> FindThere(std::span<const PlannedKeyframe> planned,
                                   std::span<const SessionSummary> sessions);

// How many of the first ones are there. A session has ours up to its last
// sequence number when it has as many keyframes as we have up to there, and its first and last
// times are those of ours; else none of ours counts as there. 0, too, when all are there: nothing
// was interrupted, and to send all of it again is what finds a keyframe that differs.
std::size_t CountSentBefore(std::span<const PlannedKeyframe> planned,
                            std::span<const SessionSummary> sessions);

}  // namespace atlas
