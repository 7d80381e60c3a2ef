// Whether the counters say what the rows do.
#pragma once

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Counts all rows. kInvalidData names the counter that is wrong, the horizon of the history among
// them.
Status CheckCounters(Connection& connection);

}  // namespace atlas
