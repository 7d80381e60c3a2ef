// A surface layer as `atlas point --json` prints it.
#pragma once

#include <boost/json/object.hpp>

#include "core/geometry/map_profile.h"
#include "core/tile/tile.h"

namespace atlas {

// z_m, sigma_m, occupancy (0..1), traversable, measured, observations, confirmed (seconds since
// 1970 when a keyframe saw it last), column {base_m, segment_m, probabilities: one a segment,
// lowest first, null where there is no data}.
boost::json::object LayerJson(const TileLayer& layer, const MapProfile& profile);

}  // namespace atlas
