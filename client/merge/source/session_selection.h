// Which sessions of a source are merged, read for a merge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client/merge/plan/merge_session.h"
#include "client/merge/plan/submap_builder.h"
#include "client/merge/source/keyframe_spool.h"
#include "client/merge/source/session_source.h"
#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

// A session that is not merged, or a keyframe that is left out, and why.
struct LeftOut {
  SessionKey key;
  std::string why;
};

struct ReadSessions {
  std::vector<MergeSession> sessions;  // by vehicle and session; those in the map first
  std::vector<BlobReader> readers;     // of each; the spool outlives them
  std::vector<LeftOut> left_out;
  // What was read is at least as new; 0: nothing was.
  std::uint64_t revision = 0;
};

// Those in the map and those that are staged, or of these alone `wanted` and what is in the map.
// Sessions that are quarantined, retracted, damaged or without a keyframe are left out, and damaged
// keyframes, or what is none of the source's profile. kNotFound: one that is wanted is not there.
// Else errors are those of the source, the spool and `progress`, which is told of keyframes.
Result<ReadSessions> ReadForMerge(
    SessionSource& source,
    const std::vector<SessionKey>& wanted,
    KeyframeSpool& spool,
    const std::function<Status(std::size_t done, std::size_t all)>& progress);

}  // namespace atlas
