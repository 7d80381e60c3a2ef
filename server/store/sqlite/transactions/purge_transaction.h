// Deleting all that a session left, as what happens inside a transaction of its own.
#pragma once

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/store_types.h"

namespace atlas {

// Keyframes, poses, footprints, tombstones and the history of its states; their bytes in the file
// are overwritten. Its name stays, and events about it. No revision before this one can be read any
// more. kInvalidData: a row that tells what is to be deleted is damaged.
Result<SessionChangeResult> PurgeSession(Connection& connection,
                                         const SessionRow& session,
                                         const SessionChange& change);

}  // namespace atlas
