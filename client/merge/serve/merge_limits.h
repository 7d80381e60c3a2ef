// How much of the map a merge may change without anybody having looked at it.
#pragma once

#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "client/merge/merge_run.h"
#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

struct MergeLimits {
  // Of each keyframe of a session in the map. Vehicles localize in it to 0.03 m: what moves by more
  // than they notice, and than a session that was held is off (0.04 m), is for people; half a metre
  // is what a drive without closures drifts in 50 m.
  double max_move_m = 0.5;
  double max_turn_rad = 1.0 * std::numbers::pi / 180.0;
  // Of each keyframe of a staged session: 1 % of 100 km. Another frame is farther away.
  double max_staged_move_m = 1'000.0;
  // Of level 0, fused again: some minutes of a daemon's work.
  std::uint64_t max_tiles = 20'000;

  // kInvalidArgument: one that is negative or no number.
  Status Validate() const;
};

// One that a merge does not keep.
struct LimitBreach {
  std::vector<SessionKey> sessions;  // that it is about: none where it is the whole merge
  std::string what;                  // for people
};

// Of those a session breaks the first in the order above. Empty: it may be applied.
std::vector<LimitBreach> CheckLimits(const MergeRun& run, const MergeLimits& limits);

}  // namespace atlas
