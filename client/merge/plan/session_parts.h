// Which sessions hang together, and where the frame of each lies in that of its part.
#pragma once

#include <cstddef>
#include <vector>

#include "client/merge/plan/closure_choice.h"
#include "client/merge/plan/closure_search.h"
#include "client/merge/plan/merge_session.h"
#include "core/alignment/closure_sets.h"

namespace atlas {

struct SessionParts {
  std::vector<std::size_t> part_of;  // by session: the session that gives its part the frame
  SubmapPoses T_world_submap;        // ways, put together by closures
};

// The frame of a part is that of its first session in the map, or of its first session where none
// is.
SessionParts PutTogether(const std::vector<MergeSession>& sessions,
                         const std::vector<SessionWay>& ways,
                         const ClosureChoice& choice);

}  // namespace atlas
