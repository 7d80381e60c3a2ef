// An area as a message. Internal to the client library: this header has Protobuf in it and is
// included by sources only.
#pragma once

#include "core/base/status.h"
#include "core/geometry/map_area.h"
#include "proto/wire/envelope.h"

namespace atlas {

// kInvalidArgument: an area that no daemon accepts or no message holds.
Status AreaToWire(const MapArea& area, wire::Area& out);

}  // namespace atlas
