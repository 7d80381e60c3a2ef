// A merge as a pose graph: its links, closures and priors over all submaps, and back.
#pragma once

#include <cstddef>
#include <vector>

#include "client/merge/graph/pose_graph.h"
#include "client/merge/plan/closure_search.h"
#include "client/merge/plan/merge_options.h"
#include "client/merge/plan/merge_session.h"
#include "client/merge/plan/session_links.h"
#include "core/base/status.h"

namespace atlas {

struct MergeEvidence {
  const std::vector<MergeSession>& sessions;
  const std::vector<std::vector<SessionLink>>& links;  // by session
  const std::vector<FoundClosure>& closures;
  const std::vector<bool>& is_held;  // by session: it stays where it is
  // By session: whether the positions that are known of it count.
  const std::vector<bool>& uses_priors;
};

struct MergedPoses {
  SubmapPoses T_world_submap;
  std::vector<double> closure_off_sigmas;  // by closure
  int iterations = 0;
};

// From `start`, where held sessions are as they are stored. Where nothing else holds a part, the
// first submap of its first session in the map stays where it starts, or of its first session where
// none is. Errors as Optimize, kInvalidArgument for a keyframe's prior without a radius.
Result<MergedPoses> OptimizeMerge(const MergeEvidence& evidence,
                                  const SubmapPoses& start,
                                  const MergeOptions& options);

}  // namespace atlas
