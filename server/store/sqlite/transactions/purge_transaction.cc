#include "server/store/sqlite/transactions/purge_transaction.h"

#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/damaged_keyframe_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/transactions/history_horizon.h"
#include "server/store/sqlite/transactions/session_transition.h"

namespace atlas {
namespace {

std::uint64_t DeleteKeyframes(Connection& connection, std::int64_t session_id) {
  const std::vector<std::int64_t> ids = ListSessionKeyframes(connection, session_id);
  for (const std::int64_t id : ids) {
    DeleteFootprint(connection, id);
    DeletePoses(connection, id);
    DeleteKeyframe(connection, id);
    DeleteDamagedKeyframe(connection, id);
  }
  return ids.size();
}

void CountOut(Connection& connection, Counter counter, std::uint64_t count) {
  AddToCounter(connection, counter, -static_cast<std::int64_t>(count));
}

void WriteWhatIsLeft(Connection& connection,
                     const SessionRow& session,
                     std::uint64_t revision,
                     const SessionChange& change) {
  SessionRow left;
  left.id = session.id;
  left.record.key = session.record.key;
  left.record.state = SessionState::kPurged;
  WriteSession(connection, left);
  DeleteSessionStates(connection, session.id);
  WriteSessionState(connection,
                    {session.id, revision, SessionState::kPurged, change.author, change.reason});
}

}  // namespace

Result<SessionChangeResult> PurgeSession(Connection& connection,
                                         const SessionRow& session,
                                         const SessionChange& change) {
  const OverwritingDeletions overwriting(connection);
  SessionChangeResult result{SessionState::kPurged, true};
  result.sessions = 1;
  result.revision = MoveHorizon(connection, change.author);
  if (IsInMap(session.record.state)) {
    result.tiles_marked = MarkSession(connection, session.id, result.revision);
  }
  const auto tombstones = DeleteTombstones(connection, session.id);
  if (!tombstones) {
    return Error(tombstones.error());
  }
  result.keyframes = DeleteKeyframes(connection, session.id);
  CountOut(connection, Counter::kKeyframes, session.record.keyframes);
  CountOut(connection, Counter::kKeyframeBytes, session.record.bytes);
  CountOut(connection, Counter::kCompacted, *tombstones);
  WriteWhatIsLeft(connection, session, result.revision, change);
  AddEvent(connection, {EventKind::kSessionPurged, change.author, StrCat(change.key),
                        StrCat(result.keyframes, " keyframes, ", session.record.bytes, " bytes",
                               change.reason.empty() ? "" : ": ", change.reason)});
  return result;
}

}  // namespace atlas
