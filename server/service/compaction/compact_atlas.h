// Compaction as one step: which keyframes can go, and away with them. Whatever changes meanwhile
// keeps its keyframes.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/base/status.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct CompactionRequest {
  std::int64_t before_ms = 0;  // keyframes taken from then on stay
  std::string author;          // a name, or empty
  std::int64_t from_ms = 0;    // those taken before stay, too
};

struct CompactionReport {
  CompactionResult stored;
  std::uint64_t tiles_checked = 0;  // fused again without what was dropped, and the same
};

// kInvalidArgument: another preset than bounded, a time before 1970, an author that is no name.
Status CheckCompaction(const CompactionRequest& request, const MapProfile& profile);

// Of an atlas whose tiles reflect `revision`, or changed since. For one caller at a time.
// kUnavailable when they change faster than the plan can follow, kInvalidData names what is
// damaged; a failed status of `check_stop`, asked before each keyframe, ends it: all then is as it
// was.
Result<CompactionReport> CompactAt(AtlasStore& store,
                                   std::uint64_t revision,
                                   const CompactionRequest& request,
                                   const std::function<Status()>& check_stop);

}  // namespace atlas
