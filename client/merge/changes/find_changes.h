// What a later visit saw otherwise than all before it, where both looked.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "client/merge/changes/change_cells.h"
#include "client/merge/changes/fused_side.h"
#include "client/merge/changes/map_change.h"
#include "core/base/status.h"

namespace atlas {

// In all tiles of `after`, things from the largest on, what appeared first. `on_tile` is told of
// each of these, `progress` of how many; both may be empty. Errors are those of the sides and of
// `progress`.
Result<std::vector<MapChange>> FindChanges(
    FusedSide& before,
    FusedSide& after,
    const MapProfile& profile,
    const ChangeOptions& options,
    const std::function<void(const Tile&)>& on_tile,
    const std::function<Status(std::size_t done, std::size_t all)>& progress);

}  // namespace atlas
