#include "server/store/sqlite/transactions/session_transition.h"

#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/session_state_table.h"

namespace atlas {

std::uint32_t MarkSession(Connection& connection, std::int64_t session_id, std::uint64_t revision) {
  const std::vector<TileId> tiles = ReadSessionFootprint(connection, session_id);
  for (const TileId& tile : tiles) {
    MarkTile(connection, tile, revision, revision);
  }
  return static_cast<std::uint32_t>(tiles.size());
}

// Footprints are of the revision of the session's last state, whether it moved them or not.
std::uint32_t EnterState(Connection& connection,
                         SessionRow session,
                         const SessionTransition& transition) {
  const bool was_in_map = IsInMap(session.record.state);
  session.record.state = transition.state;
  WriteSession(connection, session);
  WriteSessionState(connection, {session.id, transition.revision, transition.state,
                                 transition.author, transition.reason});
  const std::uint32_t marked = was_in_map != IsInMap(transition.state)
                                   ? MarkSession(connection, session.id, transition.revision)
                                   : 0;
  TouchSessionFootprint(connection, session.id, transition.revision);
  return marked;
}

std::uint32_t EnterJudgedState(Connection& connection,
                               const SessionRow& session,
                               const SessionJudgement& judgement,
                               std::uint64_t revision) {
  const bool is_quarantined = judgement.state == SessionState::kQuarantined;
  const std::uint32_t marked =
      EnterState(connection, session, {judgement.state, revision, kAtlasItself, judgement.reason});
  AddEvent(
      connection,
      {is_quarantined ? EventKind::kSessionQuarantined : EventKind::kSessionReleased, kAtlasItself,
       StrCat(session.record.key), is_quarantined ? judgement.reason : "plausible again"});
  return marked;
}

}  // namespace atlas
