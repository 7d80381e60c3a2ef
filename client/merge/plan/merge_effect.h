// What a merge would do to the atlas: whether keyframes may be where they belong, and which tiles
// would be fused again.
#pragma once

#include <set>

#include "client/merge/plan/merge_session.h"
#include "client/merge/plan/submap_builder.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

struct MovedKeyframe {
  std::size_t keyframe = 0;  // of the session
  QuantizedPose T_world_sensor;
};

// Adds the level-0 tiles that the moved keyframes touch or touched; all that `session` touches
// where it is published. kInvalidData names a keyframe that would be tilted by more than 2 degrees
// against how its grid was levelled: nothing but another upload helps. Else fails as `read` does.
Status AddTouchedTiles(const MergeSession& session,
                       const std::vector<MovedKeyframe>& moved,
                       bool is_published,
                       const BlobReader& read,
                       const MapProfile& profile,
                       std::set<TileId>& tiles);

}  // namespace atlas
