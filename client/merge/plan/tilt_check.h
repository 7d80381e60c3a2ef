// How far a session would be tilted against its grids, which were levelled when they were made: no
// more than 2 degrees, as fusion has it (PlaceKeyframe).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/merge/plan/merge_effect.h"
#include "client/merge/plan/merge_session.h"
#include "core/base/status.h"
#include "core/geometry/pose.h"

namespace atlas {

struct SessionTilt {
  double rms_rad = 0.0;  // of all keyframes
  double max_rad = 0.0;
  std::vector<std::uint32_t>
      too_far;  // sequences of the keyframes that are above the limit, rising

  // For people: which keyframes, by how much, and what to do. Of one that is too far somewhere.
  std::string Message() const;
};

// Of the session with its keyframes at `T_world_sensor`, one each. Errors are those of `read` and
// of the blobs.
Result<SessionTilt> TiltOf(const MergeSession& session,
                           const std::vector<Pose>& T_world_sensor,
                           const HeaderReader& read);

}  // namespace atlas
