#include "server/store/sqlite/transactions/session_twins.h"

#include <algorithm>
#include <cstdint>

#include "core/base/str_cat.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/keyframe_row.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/transactions/keyframe_twins.h"
#include "server/store/sqlite/transactions/purge_transaction.h"
#include "server/store/sqlite/transactions/session_transition.h"

namespace atlas {
namespace {

constexpr const char* kReason = "two sessions of its name became one";

// What is damaged stays where it is, and is given up with the others of its kind.
void MoveKeyframes(Connection& connection,
                   const SessionRow& older,
                   const SessionRow& younger,
                   const std::string& author) {
  for (const std::int64_t id : ListSessionKeyframes(connection, younger.id)) {
    const auto row = ReadKeyframeRow(connection, id);
    if (!row) {
      continue;
    }
    const std::int64_t twin = FindKeyframeId(connection, older.id, row->record.key.sequence);
    const std::int64_t kept =
        twin == 0
            ? id
            : SettleTwins(connection, {std::min(id, twin), std::max(id, twin), older.id}, author);
    if (kept == id) {
      // Its own row was read above; what SettleTwins wrote anew is of the older session already.
      static_cast<void>(MoveKeyframeRow(connection, id, older.id));
    }
  }
}

}  // namespace

Status JoinSessions(Connection& connection,
                    const SessionRow& older,
                    const SessionRow& younger,
                    const std::string& author) {
  const SessionKey& key = older.record.key;
  MoveKeyframes(connection, older, younger, author);
  if (const auto tombstones = DeleteTombstones(connection, younger.id); !tombstones) {
    return tombstones.error();
  }
  DeleteSessionStates(connection, younger.id);
  connection.Prepare("DELETE FROM sessions WHERE id = ?").Bind(younger.id).Run();
  AddLostSession(connection, older.id, key, older.record.state);  // counts what it has now
  const auto joined = ReadSession(connection, older.id);
  if (!joined) {
    return joined.error();
  }
  AddEvent(connection, {EventKind::kTablesRepaired, author, StrCat(key), kReason});
  const bool is_purged =
      older.record.state == SessionState::kPurged || younger.record.state == SessionState::kPurged;
  if (is_purged) {
    // By now its tiles may be made of it; of a purged one they are not, and nobody marks them.
    if (IsInMap(younger.record.state)) {
      MarkSession(connection, older.id, NextRevision(connection));
    }
    const auto purged =
        PurgeSession(connection, *joined, {key, SessionAction::kPurge, author, kReason});
    return purged ? Status() : purged.error();
  }
  // Tiles of keyframes that stay are what they were, unless both come into the map, or leave it:
  // the two had one name.
  EnterState(connection, *joined,
             {younger.record.state, NextRevision(connection), author, kReason});
  return {};
}

}  // namespace atlas
