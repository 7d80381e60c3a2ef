// Level l + 1 from its four children, by one rule a field (docs/formats/tile.md).
#pragma once

#include <array>

#include "core/tile/tile.h"

namespace atlas {

// `children` in the order of TileId::Children(); null where there is none. Layers of the four child
// cells under a parent cell are associated by the same test as in fusion; altitude and sigma by
// information, occupancy and columns by maximum, traversable as both all and any, observations by
// minimum. Empty when every child is.
Tile BuildParentTile(const TileId& id,
                     const std::array<const Tile*, 4>& children,
                     const MapProfile& profile);

}  // namespace atlas
