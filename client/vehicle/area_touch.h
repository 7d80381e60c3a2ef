// Which tiles an area is about, as docs/protocol.md has it: those that it touches, with their
// edges.
#pragma once

#include "client/connection/sync_query.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

bool Touches(const DiscArea& disc, const TileId& id, const MapProfile& profile);
bool Touches(const MapArea& area, const TileId& id, const MapProfile& profile);

}  // namespace atlas
