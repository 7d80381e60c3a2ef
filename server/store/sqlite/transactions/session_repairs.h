// Sessions whose rows or histories are damaged or gone, as what happens inside a savepoint.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "core/base/status.h"
#include "server/store/session_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

using SessionNames = std::map<std::int64_t, SessionKey>;

// Of sessions whose rows are damaged, what the index of names calls them: to be asked before it is
// made anew.
SessionNames ReadDamagedNames(Connection& connection);

// Rows are written anew from what other rows say. A session of which nobody tells the name any more
// gets one, vehicle "lost", so that its keyframes stay; a history that is not whole begins anew
// with what the session is now, and with it what can be read of the atlas's past; two of one name
// become one. Then their indexes are made anew. How many were repaired.
Result<std::uint32_t> RepairSessions(Connection& connection,
                                     const SessionNames& names,
                                     const std::string& author);

}  // namespace atlas
