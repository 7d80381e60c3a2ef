// Reading the store as of an earlier revision.
#pragma once

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// kInvalidArgument: later than the atlas. kNotFound: before the horizon of what is kept.
Status CheckRevisionKept(Connection& connection, std::uint64_t revision);
Result<TileSources> GatherTileSourcesAt(Connection& connection,
                                        const TileId& id,
                                        std::uint64_t revision);

}  // namespace atlas
