// Version 5 -> 6: no row is another. The quarantined sessions have an index, and `released` is a
// state that daemons of version 5 would take for one that is not in the map.
#pragma once

#include "server/store/sqlite/connection/connection.h"

namespace atlas {

void MigrateFromVersion5(Connection& connection);

}  // namespace atlas
