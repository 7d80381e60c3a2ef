// A session that enters another state, as what happens inside a savepoint.
#pragma once

#include <cstdint>
#include <string>

#include "server/store/event_types.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/tables/session_table.h"

namespace atlas {

struct SessionTransition {
  SessionState state = SessionState::kLive;
  std::uint64_t revision = 0;  // at which it happens, of this change
  std::string author;
  std::string reason;  // of the state
};

// The session's row and its line in the history, and marks on the tiles that its keyframes touch
// when it enters or leaves the map. How many.
std::uint32_t EnterState(Connection& connection,
                         SessionRow session,
                         const SessionTransition& transition);
// The same, and its event, for what the atlas finds out by itself: quarantined, or not any more.
std::uint32_t EnterJudgedState(Connection& connection,
                               const SessionRow& session,
                               const SessionJudgement& judgement,
                               std::uint64_t revision);
// Marks on the tiles that a session's keyframes touch now. How many.
std::uint32_t MarkSession(Connection& connection, std::int64_t session_id, std::uint64_t revision);

}  // namespace atlas
