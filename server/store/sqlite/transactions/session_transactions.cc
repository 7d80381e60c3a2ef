#include "server/store/sqlite/transactions/session_transactions.h"

#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/transactions/purge_transaction.h"
#include "server/store/sqlite/transactions/session_judgement.h"
#include "server/store/sqlite/transactions/session_transition.h"

namespace atlas {
namespace {

constexpr std::uint32_t kPage = 256;  // sessions read at a time

// What a retracted session is when it is back. One that nobody released is judged by what came
// meanwhile, too; a staged one when it is published.
Result<SessionJudgement> JudgeRestored(Connection& connection,
                                       const SessionRow& session,
                                       const SessionChange& change) {
  const auto before = ReadStateBeforeRetraction(connection, session.id);
  if (!before) {
    return Error(before.error());
  }
  const bool is_judged = *before != SessionState::kReleased && *before != SessionState::kStaged;
  return is_judged ? JudgeEntering(connection, session, *before, change.limits, change.reason)
                   : SessionJudgement{*before, change.reason};
}

Result<SessionJudgement> StateAfter(Connection& connection,
                                    const SessionRow& session,
                                    const SessionChange& change) {
  const SessionState state = session.record.state;
  const bool is_let_in =
      change.action == SessionAction::kRelease || change.action == SessionAction::kPublish;
  if (is_let_in && state == SessionState::kRetracted) {
    return Error(StatusCode::kConflict,
                 StrCat("session ", change.key, " is retracted: restore it first"));
  }
  switch (change.action) {
    case SessionAction::kRetract:
      return SessionJudgement{SessionState::kRetracted, change.reason};
    case SessionAction::kRestore:
      return state == SessionState::kRetracted ? JudgeRestored(connection, session, change)
                                               : SessionJudgement{state, ""};
    case SessionAction::kRelease:
      if (state == SessionState::kStaged) {
        return Error(StatusCode::kConflict,
                     StrCat("session ", change.key, " is staged: publish it first"));
      }
      return SessionJudgement{SessionState::kReleased, change.reason};
    case SessionAction::kPublish:
      return state == SessionState::kStaged
                 ? JudgeEntering(connection, session, SessionState::kLive, change.limits,
                                 change.reason)
                 : SessionJudgement{state, ""};
    case SessionAction::kPurge:
      break;
  }
  return SessionJudgement{SessionState::kPurged, change.reason};
}

EventKind KindOf(SessionAction action) {
  switch (action) {
    case SessionAction::kRetract:
      return EventKind::kRetract;
    case SessionAction::kRestore:
      return EventKind::kRestore;
    case SessionAction::kRelease:
      return EventKind::kSessionReleased;
    case SessionAction::kPublish:
      return EventKind::kSessionPublished;
    case SessionAction::kPurge:
      break;
  }
  return EventKind::kSessionPurged;
}

Result<SessionChangeResult> Enter(Connection& connection,
                                  const SessionRow& session,
                                  const SessionJudgement& after,
                                  const SessionChange& change) {
  SessionChangeResult result{after.state, true};
  result.sessions = 1;
  result.revision = NextRevision(connection);
  result.tiles_marked =
      EnterState(connection, session, {after.state, result.revision, change.author, after.reason});
  AddEvent(connection, {KindOf(change.action), change.author, StrCat(change.key), change.reason});
  if (after.state == SessionState::kQuarantined) {
    AddEvent(connection,
             {EventKind::kSessionQuarantined, kAtlasItself, StrCat(change.key), after.reason});
  }
  return result;
}

Result<SessionChangeResult> ChangeOne(Connection& connection,
                                      const SessionRow& session,
                                      const SessionChange& change) {
  if (session.record.state == SessionState::kPurged && change.action != SessionAction::kPurge) {
    return Error(StatusCode::kConflict,
                 StrCat("session ", change.key, " was purged: nothing is left of it"));
  }
  const auto after = StateAfter(connection, session, change);
  if (!after) {
    return Error(after.error());
  }
  if (after->state == session.record.state) {
    return SessionChangeResult{after->state, false, 0, ReadCounter(connection, Counter::kRevision)};
  }
  return after->state == SessionState::kPurged ? PurgeSession(connection, session, change)
                                               : Enter(connection, session, *after, change);
}

Result<SessionChangeResult> ChangeVehicle(Connection& connection, const SessionChange& change) {
  SessionChangeResult all;
  bool is_any_left = false;
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
      if (session.record.state == SessionState::kPurged) {
        continue;
      }
      is_any_left = true;
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
  if (!is_any_left) {
    return Error(StatusCode::kNotFound, StrCat("vehicle ", change.key.vehicle,
                                               " has no session: all that it had were purged"));
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
