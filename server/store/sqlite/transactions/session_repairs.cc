#include "server/store/sqlite/transactions/session_repairs.h"

#include <limits>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/sqlite/tables/start_table.h"
#include "server/store/sqlite/transactions/history_horizon.h"
#include "server/store/store_types.h"

namespace atlas {
namespace {

constexpr const char* kLostVehicle = "lost";

std::vector<std::int64_t> ListLostSessions(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT DISTINCT session_id FROM keyframes "
      "WHERE session_id NOT IN (SELECT id FROM sessions NOT INDEXED)");
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    ids.push_back(row.Int());
  }
  return ids;
}

std::vector<std::int64_t> ListSessionIds(Connection& connection) {
  Query row = connection.Prepare("SELECT id FROM sessions NOT INDEXED");
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
  SessionRepair(Connection& connection, std::string author)
      : connection_(connection), author_(std::move(author)) {}

  Result<std::uint32_t> Run() {
    for (const std::int64_t id : ListLostSessions(connection_)) {
      NameLost(id);
    }
    for (const std::int64_t id : ListDamagedSessions(connection_)) {
      if (!HasState(connection_, id)) {
        BeginHistoryOf(id, SessionState::kLive);
      }
      const bool is_vouched = TellSession(connection_, id, Vouching::kByChecksum).has_value();
      if (Status status = RestoreSession(connection_, id, Vouching::kByNobody); !status.ok()) {
        return Error(std::move(status));
      }
      if (!is_vouched) {
        MarkTilesOf(id);
        AddEvent(connection_, {EventKind::kTablesRepaired, author_, StrCat("session number ", id),
                               "its row was damaged, and nothing vouches for its name"});
      }
      ++repaired_;
    }
    for (const std::int64_t id : ListSessionIds(connection_)) {
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
  void NameLost(std::int64_t id) {
    const SessionKey key{kLostVehicle, StrCat("session-", id)};
    const auto state =
        ReadSessionStateAt(connection_, id, std::numeric_limits<std::int64_t>::max());
    AddLostSession(connection_, id, key, state ? *state : SessionState::kLive);
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
  const std::string author_;
  bool has_new_history_ = false;
  std::uint32_t repaired_ = 0;
};

}  // namespace

Result<std::uint32_t> RepairSessions(Connection& connection, const std::string& author) {
  return SessionRepair(connection, author).Run();
}

}  // namespace atlas
