#include "server/store/sqlite/tables/session_table.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "core/base/str_cat.h"
#include "core/geometry/keyframe_key.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/session_state_table.h"

// Of a whole row, as ReadRow and WriteSession have them: statements are kept by the address of a
// literal.
#define SESSION_COLUMNS_BEHIND_ID                                                           \
  "vehicle, session, state, keyframes, bytes, first_time_ms, last_time_ms, last_sequence, " \
  "compacted, checksum"
#define SESSION_COLUMNS "id, " SESSION_COLUMNS_BEHIND_ID

namespace atlas {
namespace {

std::int64_t HashOf(const SessionRow& row) {
  const SessionRecord& r = row.record;
  return RowHash(RowKind::kSession)
      .Int(row.id)
      .Text(r.key.vehicle)
      .Text(r.key.session)
      .Int(static_cast<std::int64_t>(r.state))
      .Unsigned(r.keyframes)
      .Unsigned(r.bytes)
      .Int(r.first_time_ms)
      .Int(r.last_time_ms)
      .Int(r.last_sequence)
      .Unsigned(r.compacted)
      .value();
}

// All columns but the first.
Query& BindBehindId(Query& query, const SessionRow& row) {
  const SessionRecord& r = row.record;
  query.Bind(std::string_view(r.key.vehicle)).Bind(std::string_view(r.key.session));
  query.Bind(static_cast<std::int64_t>(r.state)).Bind(r.keyframes).Bind(r.bytes);
  query.Bind(r.first_time_ms).Bind(r.last_time_ms).Bind(r.last_sequence).Bind(r.compacted);
  return query.Bind(HashOf(row));
}

// Of a row of SESSION_COLUMNS.
Result<SessionRow> ReadRow(Query& row) {
  row.Rewind();
  SessionRow result;
  result.id = row.Int();
  SessionRecord& r = result.record;
  r.key.vehicle = row.Text();
  r.key.session = row.Text();
  r.state = row.Enumerator<SessionState>();
  r.keyframes = row.Unsigned();
  r.bytes = row.Unsigned();
  r.first_time_ms = row.Int();
  r.last_time_ms = row.Int();
  r.last_sequence = row.Unsigned32();
  r.compacted = row.Unsigned();
  if (!row.IsChecksum(HashOf(result))) {
    return Error(StatusCode::kInvalidData, StrCat("store: the row of session ", result.id, " (",
                                                  r.key, ") is damaged: wrong checksum"));
  }
  return result;
}

// Of a row of SESSION_COLUMNS that is damaged: its name, which the index says, and what is wrong.
SessionRow DamagedRow(Query& row, const Status& why) {
  row.Rewind();
  SessionRow result;
  result.id = row.Int();
  result.record.key.vehicle = row.Text();
  result.record.key.session = row.Text();
  result.record.reason = why.message();
  result.record.damage = SessionDamage::kRow;
  return result;
}

bool IsNamed(const SessionKey& key) {
  return ValidateName("vehicle", key.vehicle).ok() && ValidateName("session", key.session).ok();
}

enum class OnDamage { kFail, kTell };

// Of a damaged index they may come in another order, in which who goes on behind the last one goes
// round in circles.
Result<std::vector<SessionRow>> ReadPage(Query& row, const SessionKey& after, OnDamage on_damage) {
  std::vector<SessionRow> sessions;
  while (row.Step()) {
    auto session = ReadRow(row);
    if (!session && on_damage == OnDamage::kTell) {
      if (SessionRow damaged = DamagedRow(row, session.error()); IsNamed(damaged.record.key)) {
        session = std::move(damaged);
      }
    }
    if (!session) {
      return Error(session.error());
    }
    if (session->record.key <= (sessions.empty() ? after : sessions.back().record.key)) {
      return Error(StatusCode::kInvalidData,
                   StrCat("store: the index of sessions is damaged at session ", session->id, " (",
                          session->record.key, ")"));
    }
    sessions.push_back(std::move(*session));
  }
  return sessions;
}

std::int64_t ReadChecksum(Connection& connection, std::int64_t id) {
  Query row = connection.Prepare("SELECT checksum FROM sessions WHERE id = ?");
  row.Bind(id);
  return row.Step() ? row.Int() : 0;
}

// The checksum was another row's where half of its bits differ; a few are its own damage.
bool Vouches(std::int64_t stored, std::int64_t computed) {
  return std::popcount(static_cast<std::uint64_t>(stored ^ computed)) <= 8;
}

// What its keyframes and tombstones say.
void CountRows(Connection& connection, SessionRow& session) {
  SessionRecord& r = session.record;
  Query row = connection.Prepare(
      "SELECT count(*) FILTER (WHERE is_stored), coalesce(sum(bytes) FILTER (WHERE is_stored), 0), "
      "coalesce(min(time_ms), 0), coalesce(max(time_ms), 0), coalesce(max(sequence) FILTER (WHERE "
      "sequence BETWEEN 0 AND 0xFFFFFFFF), 0), "
      "count(*) FILTER (WHERE NOT is_stored) FROM ("
      "SELECT 1 AS is_stored, blob_bytes AS bytes, time_ms, sequence FROM keyframes "
      "WHERE session_id = ?1 UNION ALL "
      "SELECT 0, blob_bytes, time_ms, sequence FROM tombstones WHERE session_id = ?1)");
  row.Bind(session.id);
  if (row.Step()) {
    r.keyframes = row.Unsigned();
    r.bytes = row.Unsigned();
    r.first_time_ms = row.Int();
    r.last_time_ms = row.Int();
    r.last_sequence = row.Unsigned32();
    r.compacted = row.Unsigned();
  }
}

}  // namespace

Result<std::optional<SessionRow>> FindSession(Connection& connection, const SessionKey& key) {
  Query row = connection.Prepare("SELECT " SESSION_COLUMNS
                                 " FROM sessions WHERE vehicle = ? AND session = ?");
  row.Bind(std::string_view(key.vehicle)).Bind(std::string_view(key.session));
  if (!row.Step()) {
    return std::nullopt;
  }
  auto session = ReadRow(row);
  if (!session) {
    return Error(session.error());
  }
  return std::move(*session);
}

Result<std::vector<SessionRow>> ReadVehicleSessions(Connection& connection,
                                                    const SessionKey& after,
                                                    std::uint32_t limit) {
  Query row = connection.Prepare("SELECT " SESSION_COLUMNS
                                 " FROM sessions WHERE vehicle = ? AND session > ? "
                                 "ORDER BY session LIMIT ?");
  row.Bind(std::string_view(after.vehicle)).Bind(std::string_view(after.session)).Bind(limit);
  return ReadPage(row, after, OnDamage::kFail);
}

Result<std::vector<SessionRecord>> ReadSessions(Connection& connection,
                                                const SessionKey& after,
                                                std::uint32_t limit) {
  Query row = connection.Prepare("SELECT " SESSION_COLUMNS
                                 " FROM sessions WHERE (vehicle, session) > (?, ?) "
                                 "ORDER BY vehicle, session LIMIT ?");
  row.Bind(std::string_view(after.vehicle)).Bind(std::string_view(after.session)).Bind(limit);
  auto page = ReadPage(row, after, OnDamage::kTell);
  if (!page) {
    return Error(page.error());
  }
  std::vector<SessionRecord> sessions;
  sessions.reserve(page->size());
  for (SessionRow& session : *page) {
    SessionRecord& r = session.record;
    if (r.damage == SessionDamage::kNone && r.state != SessionState::kLive) {
      auto reason = ReadStateReason(connection, session.id);
      r.damage = reason ? SessionDamage::kNone : SessionDamage::kHistory;
      r.reason = reason ? std::move(*reason) : reason.error().message();
    }
    sessions.push_back(std::move(session.record));
  }
  return sessions;
}

Result<SessionRow> ReadSession(Connection& connection, std::int64_t id) {
  Query row = connection.Prepare("SELECT " SESSION_COLUMNS " FROM sessions WHERE id = ?");
  row.Bind(id);
  if (!row.Step()) {
    return Error(StatusCode::kInvalidData, StrCat("store: the row of session ", id, " is missing"));
  }
  return ReadRow(row);
}

Status CheckSessionHistory(Connection& connection, const SessionKey& key) {
  const auto session = FindSession(connection, key);
  if (!session) {
    return session.error();
  }
  if (!*session) {
    return {};
  }
  const auto& [id, record] = **session;
  ATLAS_RETURN_IF_ERROR(CheckSessionStates(connection, id, record.state));
  return CheckTombstones(connection, id, record.compacted);
}

void WriteSession(Connection& connection, const SessionRow& row) {
  Query insert = connection.Prepare("INSERT OR REPLACE INTO sessions (" SESSION_COLUMNS
                                    ") VALUES (?,?,?,?,?,?,?,?,?,?,?)");
  insert.Bind(row.id);
  BindBehindId(insert, row).Run();
}

std::uint64_t CountQuarantined(Connection& connection) {
  static_assert(static_cast<int>(SessionState::kQuarantined) == 2);  // as the index has it
  Query row = connection.Prepare("SELECT count(*) FROM sessions WHERE state = 2");
  return row.Step() ? row.Unsigned() : 0;
}

std::vector<std::int64_t> ListDamagedSessions(Connection& connection) {
  Query row = connection.Prepare("SELECT " SESSION_COLUMNS " FROM sessions NOT INDEXED");
  std::vector<std::int64_t> damaged;
  while (row.Step()) {
    if (!ReadRow(row)) {
      row.Rewind();
      damaged.push_back(row.Int());
    }
  }
  return damaged;
}

bool IsSessionRowOf(Connection& connection, std::int64_t id, std::int64_t other) {
  Query row =
      connection.Prepare("SELECT ?2, " SESSION_COLUMNS_BEHIND_ID " FROM sessions WHERE id = ?1");
  row.Bind(id).Bind(other);
  return row.Step() && ReadRow(row).has_value();
}

std::optional<SessionKey> NameByIndex(Connection& connection, std::int64_t id) {
  Query names = connection.Prepare(
      "SELECT vehicle, session FROM sessions INDEXED BY sqlite_autoindex_sessions_1 "
      "WHERE vehicle >= '' AND id = ?");
  names.Bind(id);
  if (!names.Step()) {
    return std::nullopt;
  }
  SessionKey key;
  key.vehicle = names.Text();
  key.session = names.Text();
  return IsNamed(key) ? std::optional(std::move(key)) : std::nullopt;
}

std::optional<SessionKey> NameByRow(Connection& connection, std::int64_t id) {
  Query row = connection.Prepare("SELECT vehicle, session FROM sessions NOT INDEXED WHERE id = ?");
  row.Bind(id);
  if (!row.Step()) {
    return std::nullopt;
  }
  SessionKey key;
  key.vehicle = row.Text();
  key.session = row.Text();
  return IsNamed(key) ? std::optional(std::move(key)) : std::nullopt;
}

bool IsNameOfAnother(Connection& connection, const SessionKey& key, std::int64_t id) {
  Query row = connection.Prepare(
      "SELECT 1 FROM sessions NOT INDEXED WHERE vehicle = ? AND session = ? AND id <> ?");
  row.Bind(std::string_view(key.vehicle)).Bind(std::string_view(key.session)).Bind(id);
  return row.Step();
}

Result<SessionRow> TellSession(Connection& connection, std::int64_t id, Vouching vouching) {
  const auto name = NameByIndex(connection, id);
  if (!name) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the index of session ", id, " is damaged, as is its row"));
  }
  return TellNamedSession(connection, id, *name, vouching);
}

Result<SessionRow> TellNamedSession(Connection& connection,
                                    std::int64_t id,
                                    const SessionKey& name,
                                    Vouching vouching) {
  SessionRow row;
  row.id = id;
  SessionRecord& r = row.record;
  r.key = name;
  const auto state = ReadSessionStateAt(connection, id, std::numeric_limits<std::int64_t>::max());
  if (!state) {
    return Error(state.error());
  }
  r.state = *state;
  CountRows(connection, row);
  if (vouching == Vouching::kByChecksum && !Vouches(ReadChecksum(connection, id), HashOf(row))) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: what the row of session ", id, " was cannot be told"));
  }
  return row;
}

Status RestoreSession(Connection& connection, std::int64_t id, Vouching vouching) {
  const auto row = TellSession(connection, id, vouching);
  if (!row) {
    return row.error();
  }
  const ToleratedIndexes tolerated(connection);  // the index of names has what is told
  PutBackSessions(connection, {*row});
  return {};
}

// A row that is replaced would find what an index still has of itself in its way.
void PutBackSessions(Connection& connection, const std::vector<SessionRow>& rows) {
  WithoutCounting(connection, RowKind::kSession, [&] {
    for (const SessionRow& row : rows) {
      Query update = connection.Prepare(
          "UPDATE sessions SET vehicle = ?, session = ?, state = ?, keyframes = ?, bytes = ?, "
          "first_time_ms = ?, last_time_ms = ?, last_sequence = ?, compacted = ?, checksum = ? "
          "WHERE id = ?");
      BindBehindId(update, row).Bind(row.id).Run();
    }
  });
}

int RecountSessions(Connection& connection) {
  std::vector<SessionRow> rows;
  {
    Query query = connection.Prepare("SELECT " SESSION_COLUMNS " FROM sessions NOT INDEXED");
    while (query.Step()) {
      if (auto row = ReadRow(query)) {
        rows.push_back(std::move(*row));
      }
    }
  }
  int changed = 0;
  for (SessionRow& row : rows) {
    SessionRow counted = row;
    CountRows(connection, counted);
    if (counted.record.keyframes != row.record.keyframes ||
        counted.record.bytes != row.record.bytes ||
        counted.record.compacted != row.record.compacted) {
      row.record.keyframes = counted.record.keyframes;
      row.record.bytes = counted.record.bytes;
      row.record.compacted = counted.record.compacted;
      WriteSession(connection, row);
      ++changed;
    }
  }
  return changed;
}

void AddLostSession(Connection& connection,
                    std::int64_t id,
                    const SessionKey& key,
                    SessionState state) {
  SessionRow row;
  row.id = id;
  row.record.key = key;
  row.record.state = state;
  CountRows(connection, row);
  WriteSession(connection, row);
}

SessionRow AddSession(Connection& connection, const SessionKey& key, SessionState state) {
  SessionRow row;
  row.id = static_cast<std::int64_t>(
      TakeNumber(connection, Counter::kSessions, "SELECT 1 FROM sessions WHERE id = ?"));
  row.record.key = key;
  row.record.state = state;
  WriteSession(connection, row);
  return row;
}

SessionRow CountKeyframe(Connection& connection, SessionRow session, const NewKeyframe& keyframe) {
  SessionRecord& r = session.record;
  const bool is_first = HasNoneYet(r);
  r.first_time_ms = is_first ? keyframe.time_ms : std::min(r.first_time_ms, keyframe.time_ms);
  r.last_time_ms = is_first ? keyframe.time_ms : std::max(r.last_time_ms, keyframe.time_ms);
  r.last_sequence = std::max(r.last_sequence, keyframe.key.sequence);
  ++r.keyframes;
  r.bytes += keyframe.blob.size();
  WriteSession(connection, session);
  return session;
}

}  // namespace atlas
