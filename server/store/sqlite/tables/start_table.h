// When the store was opened (AtlasStart).
#pragma once

#include <vector>

#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// Adds a row for now, in a table that it makes where there is none, and forgets all but the last
// hundred. The value: these, oldest first, those before a damaged one left out; none where the disk
// refuses.
std::vector<AtlasStart> AddStart(Connection& connection);

}  // namespace atlas
