// Taking sessions out of the map and putting them back, as what happens inside a savepoint.
#pragma once

#include "core/base/status.h"
#include "server/store/session_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

Result<SessionChangeResult> ChangeSessionInStore(Connection& connection,
                                                 const SessionChange& change);

}  // namespace atlas
