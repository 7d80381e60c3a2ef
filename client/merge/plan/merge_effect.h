// What a merge would do to the atlas: which tiles would be fused again.
#pragma once

#include <functional>
#include <set>

#include "client/merge/plan/merge_session.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"
#include "core/keyframe/keyframe_codec.h"

namespace atlas {

// Of a session's keyframes, as BlobReader.
using HeaderReader = std::function<Result<KeyframeHeader>(std::size_t keyframe)>;

struct MovedKeyframe {
  std::size_t keyframe = 0;  // of the session
  QuantizedPose T_world_sensor;
};

// Adds the level-0 tiles that the moved keyframes touch or touched; all that `session` touches
// where it is published. kInvalidData names a keyframe that would be tilted by more than 2 degrees
// against how its grid was levelled (tilt_check.h). Else fails as `read` does.
Status AddTouchedTiles(const MergeSession& session,
                       const std::vector<MovedKeyframe>& moved,
                       bool is_published,
                       const HeaderReader& read,
                       const MapProfile& profile,
                       std::set<TileId>& tiles);

}  // namespace atlas
