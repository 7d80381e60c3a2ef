// Version 1 knew what is, not what was.
#pragma once

#include "core/geometry/map_profile.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Inside of a transaction. The history of states and footprints is made of that of poses, and tiles
// go: their blobs are of a format that is no longer read. All are fused again, by today's rules.
void MigrateFromVersion1(Connection& connection, const MapProfile& profile);

}  // namespace atlas
