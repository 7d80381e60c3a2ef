// Which positions that are known of keyframes a merge goes by, and in whose frame. Where a part has
// nothing in the map, it is put where its positions have it; where it has, the map stays where it
// is, and positions that have it elsewhere are not used.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "client/merge/plan/closure_search.h"
#include "client/merge/plan/merge_options.h"
#include "client/merge/plan/merge_session.h"

namespace atlas {

// Of a session's positions.
struct PriorUse {
  std::size_t count = 0;  // of them
  bool is_used = false;
  std::string why_not;  // for people; empty where there is none
};

// Keyframes of the session with a position.
std::size_t CountPriors(const MergeSession& session);

// By session. Moves `T_world_submap`, of each session's submaps, as whole parts (`part_of` each),
// to where most of a part's positions agree; then half of a session's own have to, or they are not
// used. A session in the map that is not held is moved by no more
// than `max_frame_shift_m`: farther away the map has another frame.
std::vector<PriorUse> PlaceByPriors(const std::vector<MergeSession>& sessions,
                                    const std::vector<std::size_t>& part_of,
                                    const std::vector<bool>& is_held,
                                    const PriorOptions& options,
                                    SubmapPoses& T_world_submap);

// How far the session's keyframes are from their positions, in metres, half of them at most; 0
// where there is none.
double MedianOff(const MergeSession& session, const std::vector<Pose>& T_world_submap);

}  // namespace atlas
