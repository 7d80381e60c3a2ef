// Whether a session is what it was at a revision. What counts as a change: a keyframe that came to
// it, a pose of it that was corrected, another state, keyframes that compactions or a purge took.
// Whoever computed something of sessions asks that before it is applied; other sessions do not
// matter (docs/decisions/0701-conditional-batches.md).
#pragma once

#include <cstdint>
#include <set>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/store_types.h"

namespace atlas {

// kConflict names the first one that changed after `revision`, what changed and when; the same when
// that is before the history's horizon, or lost: nothing tells. kInvalidArgument: the atlas is not
// there yet. kNotFound: there is no such session. kInvalidData: its row is damaged.
Status CheckUnchanged(Connection& connection,
                      const StoreIdentity& identity,
                      const std::set<SessionKey>& sessions,
                      std::uint64_t revision);

// The last revision at which one changed. One look at the pose of each of its keyframes.
std::uint64_t ReadChangedRevision(Connection& connection, const SessionRow& session);

// Behind `after` as ReadSessions, with the revisions at which they changed last: fewer than `limit`
// where they have many keyframes, one at least.
Result<SessionPage> ReadChangedSessions(Connection& connection,
                                        const SessionKey& after,
                                        std::uint32_t limit);

}  // namespace atlas
