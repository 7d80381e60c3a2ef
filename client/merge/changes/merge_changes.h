// What the sessions that a merge brings into the map saw otherwise than those before them.
#pragma once

#include <functional>
#include <vector>

#include "client/merge/changes/change_cells.h"
#include "client/merge/changes/map_change.h"
#include "client/merge/plan/merge_session.h"
#include "client/merge/plan/submap_builder.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/tile/tile.h"

namespace atlas {

// A session where the merge has it.
struct PlacedSession {
  const MergeSession* session = nullptr;
  std::vector<Pose> T_world_sensor;  // of each keyframe
  const BlobReader* read = nullptr;
};

// By when the middle of their keyframes was taken.
bool IsEarlier(const MergeSession& one, const MergeSession& other);

// Of `later`, against those that were there before. Things as FindChanges has them. `on_tile` is
// told of each tile of `later`; both it and `progress` may be empty. Errors are those of FusedSide
// and of `progress`.
Result<std::vector<MapChange>> ChangesSeenBy(
    const PlacedSession& later,
    const std::vector<PlacedSession>& earlier,
    const MapProfile& profile,
    const ChangeOptions& options,
    const std::function<void(const Tile&)>& on_tile,
    const std::function<Status(std::size_t done, std::size_t all)>& progress);

}  // namespace atlas
