// Sessions whose rows or histories are damaged or gone, as what happens inside a savepoint.
#pragma once

#include <cstdint>
#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// Rows are written anew from what other rows say. A session of which nobody tells the name any more
// gets one, vehicle "lost", so that its keyframes stay; a history that is not whole begins anew
// with what the session is now, and with it what can be read of the atlas's past. How many were
// repaired.
Result<std::uint32_t> RepairSessions(Connection& connection, const std::string& author);

}  // namespace atlas
