#include "server/store/sqlite/transactions/session_transactions.h"

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {
namespace {

constexpr std::uint32_t kPage = 256;  // sessions read at a time

Result<SessionState> StateAfter(Connection& connection,
                                const SessionRow& session,
                                SessionAction action) {
  if (action == SessionAction::kRetract) {
    return SessionState::kRetracted;
  }
  return session.record.state == SessionState::kRetracted
             ? ReadStateBeforeRetraction(connection, session.id)
             : session.record.state;
}

EventKind KindOf(SessionAction action) {
  return action == SessionAction::kRetract ? EventKind::kRetract : EventKind::kRestore;
}

std::uint32_t MarkSession(Connection& connection, std::int64_t session_id, std::uint64_t revision) {
  const std::vector<TileId> tiles = ReadSessionFootprint(connection, session_id);
  for (const TileId& tile : tiles) {
    MarkTile(connection, tile, revision, revision);
  }
  TouchSessionFootprint(connection, session_id, revision);
  return static_cast<std::uint32_t>(tiles.size());
}

SessionChangeResult EnterState(Connection& connection,
                               SessionRow session,
                               SessionState state,
                               const SessionChange& change) {
  const bool was_in_map = IsInMap(session.record.state);
  SessionChangeResult result{state, true};
  result.sessions = 1;
  result.revision = NextRevision(connection);
  session.record.state = state;
  WriteSession(connection, session);
  WriteSessionState(connection, {session.id, result.revision, state, change.author, change.reason});
  if (was_in_map != IsInMap(state)) {
    result.tiles_marked = MarkSession(connection, session.id, result.revision);
  }
  AddEvent(connection, {KindOf(change.action), change.author, StrCat(change.key), change.reason});
  return result;
}

Result<SessionChangeResult> ChangeOne(Connection& connection,
                                      const SessionRow& session,
                                      const SessionChange& change) {
  const auto state = StateAfter(connection, session, change.action);
  if (!state) {
    return Error(state.error());
  }
  if (*state == session.record.state) {
    return SessionChangeResult{*state, false, 0, ReadCounter(connection, Counter::kRevision)};
  }
  return EnterState(connection, session, *state, change);
}

Result<SessionChangeResult> ChangeVehicle(Connection& connection, const SessionChange& change) {
  SessionChangeResult all;
  SessionChange one = change;
  one.key.session.clear();
  while (true) {
    const auto sessions = ReadVehicleSessions(connection, one.key, kPage);
    if (!sessions) {
      return Error(sessions.error());
    }
    if (sessions->empty()) {
      break;
    }
    for (const SessionRow& session : *sessions) {
      one.key = session.record.key;
      const auto result = ChangeOne(connection, session, one);
      if (!result) {
        return result;
      }
      all.state = result->state;
      all.is_changed = all.is_changed || result->is_changed;
      all.tiles_marked += result->tiles_marked;
      all.revision = result->revision;
      all.sessions += result->sessions;
    }
  }
  if (one.key.session.empty()) {
    return Error(StatusCode::kNotFound,
                 StrCat("vehicle ", change.key.vehicle, " is not in the atlas"));
  }
  return all;
}

}  // namespace

Result<SessionChangeResult> ChangeSessionInStore(Connection& connection,
                                                 const SessionChange& change) {
  if (change.key.session.empty()) {
    return ChangeVehicle(connection, change);
  }
  const auto session = FindSession(connection, change.key);
  if (!session) {
    return Error(session.error());
  }
  if (!*session) {
    return Error(StatusCode::kNotFound, StrCat("session ", change.key, " is not in the atlas"));
  }
  return ChangeOne(connection, **session, change);
}

}  // namespace atlas
