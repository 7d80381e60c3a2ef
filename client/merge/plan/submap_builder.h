// A session's keyframes to its submaps.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "client/merge/plan/merge_context.h"
#include "client/merge/plan/merge_session.h"
#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// The blob of a keyframe of the session; asked for in their order, by the caller's thread.
using BlobReader = std::function<Result<Bytes>(std::size_t keyframe)>;

// Cuts `session` and fills its submaps, fused by `T_world_sensor` of its keyframes unless the work
// has them as near as `tolerance`; some are in work at a time, not all keyframes in memory. The cut
// is that of the stored poses, and stays when these are corrected, as long as the work lasts.
// kInvalidData: a keyframe is damaged, not what its hash says, of another profile, or its pose
// tilted against its grid by more than 2 degrees; the message names it. Else errors are those of
// `read`, the work and `progress`, which is told of submaps, by the caller's thread.
Status BuildSubmaps(MergeSession& session,
                    const std::vector<Pose>& T_world_sensor,
                    const BlobReader& read,
                    const MergeContext& context,
                    const ShapeTolerance& tolerance,
                    const std::function<Status(std::size_t done, std::size_t all)>& progress);

}  // namespace atlas
