// Preset bounded: which keyframes a level-0 tile is still made of. One that spoke, in every cell,
// to segments alone that count no more leaves the tile as it is when it goes; but for what the
// others then join, which only a fusion without it tells.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/fusion/observation/frame_on_map.h"

namespace atlas {

// The indices, ascending, of those of `frames` that `is_asked` for and that spoke to a segment that
// counts in some cell of the tile. `frames`: all whose footprints touch it, in any order. Where
// none is asked for no keyframe is read; else each about once, and those of a stretch with one that
// is asked for about twice: `max_bytes` as FuseTile's. Errors are the source's.
Result<std::vector<std::size_t>> FindNeededFrames(
    const TileId& id,
    std::span<const FrameOnMap> frames,
    const std::function<bool(std::size_t index)>& is_asked,
    const KeyframeSource& source,
    const MapProfile& profile,
    std::size_t max_bytes = std::size_t{128} << 20);

}  // namespace atlas
