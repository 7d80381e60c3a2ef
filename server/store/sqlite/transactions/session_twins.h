// Two sessions of one name: an index that had lost the first one let it begin again. As what
// happens inside a savepoint.
#pragma once

#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/tables/session_table.h"

namespace atlas {

// The keyframes of the younger one become those of the older one, each once, and the state of the
// younger one, who alone was found under the name, becomes its state; if either was purged, both
// are. Marks what either touched; the horizon is to be moved behind it. kInvalidData: a tombstone
// is damaged.
Status JoinSessions(Connection& connection,
                    const SessionRow& older,
                    const SessionRow& younger,
                    const std::string& author);

}  // namespace atlas
