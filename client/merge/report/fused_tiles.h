// The tiles of all levels that are fused again when some of the finest are.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "core/geometry/tile_id.h"

namespace atlas {

// By level, as many sets as the pyramid has levels; each rising. `finest` are of level 0.
std::vector<std::set<TileId>> FusedTiles(const std::set<TileId>& finest, std::uint8_t levels);

}  // namespace atlas
