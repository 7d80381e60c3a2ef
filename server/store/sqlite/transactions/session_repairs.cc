#include "server/store/sqlite/transactions/session_repairs.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/transactions/history_horizon.h"
#include "server/store/sqlite/transactions/session_twins.h"
#include "server/store/store_types.h"

namespace atlas {
namespace {

constexpr const char* kLostVehicle = "lost";
// What nothing tells of may have been retracted: somebody has to look before it is in the map.
constexpr SessionState kUnknownState = SessionState::kQuarantined;

// A damaged row may name a session that never was.
bool HasWholeKeyframe(Connection& connection, std::int64_t session_id) {
  const auto ids = ListSessionKeyframes(connection, session_id);
  return std::any_of(ids.begin(), ids.end(), [&connection](std::int64_t id) {
    return ReadKeyframeRow(connection, id).has_value();
  });
}

std::vector<std::int64_t> ListLostSessions(Connection& connection) {
  std::vector<std::int64_t> ids;
  {
    Query row = connection.Prepare(
        "SELECT DISTINCT session_id FROM keyframes "
        "WHERE session_id NOT IN (SELECT id FROM sessions NOT INDEXED)");
    while (row.Step()) {
      row.Rewind();
      ids.push_back(row.Int());
    }
  }
  std::erase_if(ids, [&](std::int64_t id) { return !HasWholeKeyframe(connection, id); });
  return ids;
}

std::vector<std::int64_t> ListSessionIds(Connection& connection, const char* sql) {
  Query row = connection.Prepare(sql);
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    ids.push_back(row.Int());
  }
  return ids;
}

bool HasState(Connection& connection, std::int64_t id) {
  return ReadSessionStateAt(connection, id, std::numeric_limits<std::int64_t>::max()).has_value();
}

// Live first, for who restores a session that is retracted.
void BeginHistory(Connection& connection,
                  std::int64_t id,
                  SessionState state,
                  const std::string& author) {
  DeleteSessionStates(connection, id);
  SessionStateRow line{id, NextRevision(connection), SessionState::kLive, author,
                       "what it was before is lost"};
  WriteSessionState(connection, line);
  if (state != SessionState::kLive) {
    line.revision = NextRevision(connection);
    line.state = state;
    WriteSessionState(connection, line);
  }
}

class SessionRepair {
 public:
  SessionRepair(Connection& connection, const SessionNames& names, std::string author)
      : connection_(connection), names_(names), author_(std::move(author)) {}

  Result<std::uint32_t> Run() {
    if (Status status = RepairRows(); !status.ok()) {
      return Error(std::move(status));
    }
    for (const std::int64_t id :
         ListSessionIds(connection_, "SELECT id FROM sessions NOT INDEXED")) {
      const auto session = ReadSession(connection_, id);
      if (!session) {
        return Error(session.error());
      }
      if (!CheckSessionStates(connection_, id, session->record.state).ok()) {
        BeginHistoryOf(id, session->record.state);
        ++repaired_;
      }
    }
    if (has_new_history_) {
      MoveHorizon(connection_, author_);
    }
    return repaired_;
  }

 private:
  // Of each id and each name one, that is whole.
  Status RepairRows() {
    const ToleratedIndexes tolerated(connection_);
    RestoreIds();
    for (const std::int64_t id : ListLostSessions(connection_)) {
      NameLost(id);
    }
    for (const std::int64_t id : ListDamagedSessions(connection_)) {
      ATLAS_RETURN_IF_ERROR(RepairRow(id));
      ++repaired_;
    }
    ATLAS_RETURN_IF_ERROR(JoinTwins());
    connection_.Execute("REINDEX sessions");
    return {};
  }

  // An index that has the name under the true id would let nobody write that.
  void RestoreIds() {
    const std::vector<std::int64_t> damaged = ListDamagedSessions(connection_);
    const bool has_twins = connection_.Ask(
                               "SELECT EXISTS (SELECT 1 FROM sessions NOT INDEXED "
                               "GROUP BY vehicle, session HAVING count(*) > 1)") != 0;
    if (!damaged.empty() && !has_twins) {
      connection_.Execute("REINDEX sessions");
    }
    for (const std::int64_t id : damaged) {
      RestoreId(id);
    }
  }

  // Of which one bit turned.
  void RestoreId(std::int64_t id) {
    for (int bit = 0; bit < 63; ++bit) {
      const std::int64_t other = id ^ (std::int64_t{1} << bit);
      if (IsSessionRowOf(connection_, id, other)) {
        Query update = connection_.Prepare("UPDATE OR IGNORE sessions SET id = ? WHERE id = ?");
        repaired_ += update.Bind(other).Bind(id).Run() > 0 ? 1U : 0U;
        return;
      }
    }
  }

  // Vouched for where the row's checksum is that of what is told by the name.
  Status RepairRow(std::int64_t id) {
    const bool has_state = HasState(connection_, id);
    if (!has_state) {
      BeginHistoryOf(id, SessionState::kLive);
    }
    std::vector<SessionKey> names;
    if (const auto by_index = names_.find(id); by_index != names_.end()) {
      names.push_back(by_index->second);
    }
    if (auto by_row = NameByRow(connection_, id)) {
      names.push_back(*std::move(by_row));
    }
    std::erase_if(names, [this, id](const SessionKey& name) {
      return IsNameOfAnother(connection_, name, id);
    });
    for (const SessionKey& name : names) {
      if (const auto row = TellNamedSession(connection_, id, name, Vouching::kByChecksum)) {
        PutBackSessions(connection_, {*row});
        return {};
      }
    }
    names.push_back(LostName(id));
    if (!has_state) {
      BeginHistoryOf(id, kUnknownState);
    }
    const auto row = TellNamedSession(connection_, id, names.front(), Vouching::kByNobody);
    if (!row) {
      return row.error();
    }
    PutBackSessions(connection_, {*row});
    MarkTilesOf(id);
    AddEvent(connection_, {EventKind::kTablesRepaired, author_, StrCat("session number ", id),
                           "its row was damaged, and nothing vouches for its name"});
    return {};
  }

  // Of one name. The older one stays.
  Status JoinTwins() {
    const std::vector<std::int64_t> ids = ListSessionIds(
        connection_,
        "SELECT id FROM sessions NOT INDEXED WHERE (vehicle, session) IN "
        "(SELECT vehicle, session FROM sessions NOT INDEXED GROUP BY 1, 2 HAVING count(*) > 1) "
        "ORDER BY vehicle, session, id");
    std::optional<SessionRow> older;
    for (const std::int64_t id : ids) {
      auto session = ReadSession(connection_, id);
      if (!session) {
        return session.error();
      }
      if (!older || older->record.key != session->record.key) {
        older = *std::move(session);
        continue;
      }
      ATLAS_RETURN_IF_ERROR(JoinSessions(connection_, *older, *session, author_));
      auto joined = ReadSession(connection_, older->id);
      if (!joined) {
        return joined.error();
      }
      older = *std::move(joined);
      has_new_history_ = true;
      ++repaired_;
    }
    return {};
  }

  // A vehicle may be called so, too.
  SessionKey LostName(std::int64_t id) {
    SessionKey name{kLostVehicle, StrCat("session-", id)};
    for (int i = 2; IsNameOfAnother(connection_, name, id); ++i) {
      name.session = StrCat("session-", id, "-", i);
    }
    return name;
  }

  void NameLost(std::int64_t id) {
    const SessionKey key = LostName(id);
    const auto state =
        ReadSessionStateAt(connection_, id, std::numeric_limits<std::int64_t>::max());
    AddLostSession(connection_, id, key, state ? *state : kUnknownState);
    MarkTilesOf(id);
    has_new_history_ = true;
    AddEvent(connection_, {EventKind::kTablesRepaired, author_, StrCat(key),
                           StrCat("the row of session number ", id,
                                  " was gone, and with it its name: its keyframes stay under "
                                  "this one")});
    ++repaired_;
  }

  // What keyframes make of a tile goes by their names, too.
  void MarkTilesOf(std::int64_t id) {
    Query row = connection_.Prepare(
        "SELECT DISTINCT tile_key FROM keyframe_tiles WHERE is_current AND keyframe_id IN "
        "(SELECT id FROM keyframes WHERE session_id = ?)");
    row.Bind(id);
    std::vector<TileId> tiles;
    while (row.Step()) {
      row.Rewind();
      if (const auto tile = TileId::FromKey(row.Unsigned()); tile && tile->level == 0) {
        tiles.push_back(*tile);
      }
    }
    const std::uint64_t revision = NextRevision(connection_);
    for (const TileId& tile : tiles) {
      MarkTile(connection_, tile, revision, kReflectsNothing);
    }
  }

  void BeginHistoryOf(std::int64_t id, SessionState state) {
    BeginHistory(connection_, id, state, author_);
    AddEvent(connection_, {EventKind::kTablesRepaired, author_, StrCat("session number ", id),
                           "its history was not whole and begins anew"});
    has_new_history_ = true;
  }

  Connection& connection_;
  const SessionNames& names_;
  const std::string author_;
  bool has_new_history_ = false;
  std::uint32_t repaired_ = 0;
};

}  // namespace

SessionNames ReadDamagedNames(Connection& connection) {
  SessionNames names;
  for (const std::int64_t id : ListDamagedSessions(connection)) {
    try {
      if (auto name = NameByIndex(connection, id)) {
        names[id] = *std::move(name);
      }
    } catch (const std::exception& error) {
      if (StatusFromException(error).code() != StatusCode::kInvalidData) {
        throw;
      }  // an index that cannot be read tells nothing
    }
  }
  return names;
}

Result<std::uint32_t> RepairSessions(Connection& connection,
                                     const SessionNames& names,
                                     const std::string& author) {
  return SessionRepair(connection, names, author).Run();
}

}  // namespace atlas
