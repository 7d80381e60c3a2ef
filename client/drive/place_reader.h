// The places of a whole map, for whoever has no idea where he is in it.
#pragma once

#include <memory>

#include "client/map/map_view.h"
#include "core/base/status.h"
#include "core/localization/places/place_index.h"

namespace atlas {

// Reads all level-0 tiles, one after the other, and keeps none. Fails as the view does.
Result<std::shared_ptr<const PlaceIndex>> ReadPlaces(MapView& view);

}  // namespace atlas
