#include "server/store/sqlite/tables/session_state_table.h"

#include <optional>
#include <string_view>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

std::int64_t HashOf(const SessionStateRow& row) {
  return RowHash(RowKind::kSessionState)
      .Int(row.session_id)
      .Unsigned(row.revision)
      .Int(static_cast<std::int64_t>(row.state))
      .Text(row.author)
      .Text(row.reason)
      .value();
}

// Columns: session_id, revision, state, author, reason, checksum.
Result<SessionStateRow> ReadRow(Query& row) {
  row.Rewind();
  SessionStateRow result;
  result.session_id = row.Int();
  result.revision = row.Unsigned();
  result.state = row.Enumerator<SessionState>();
  result.author = row.Text();
  result.reason = row.Text();
  if (!row.IsChecksum(HashOf(result))) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the state of session ", result.session_id, " at revision ",
                        result.revision, " is damaged: wrong checksum"));
  }
  return result;
}

Status Missing(std::int64_t session_id) {
  return Status(StatusCode::kInvalidData,
                StrCat("store: the history of session ", session_id, " is not whole"));
}

// The only row of a query.
Result<SessionStateRow> ReadOnly(Query& row, std::int64_t session_id) {
  if (!row.Step()) {
    return Error(Missing(session_id));
  }
  return ReadRow(row);
}

// The line of what a retracted session was before.
Result<SessionStateRow> ReadBeforeRetraction(Connection& connection, std::int64_t session_id) {
  Query row = connection.Prepare(
      "SELECT session_id, revision, state, author, reason, checksum FROM session_states "
      "WHERE session_id = ? AND state <> ? ORDER BY revision DESC LIMIT 1");
  row.Bind(session_id).Bind(static_cast<std::int64_t>(SessionState::kRetracted));
  return ReadOnly(row, session_id);
}

Result<SessionState> ReadState(Query& row, std::int64_t session_id) {
  const auto stored = ReadOnly(row, session_id);
  return stored ? Result<SessionState>(stored->state) : Error(stored.error());
}

}  // namespace

void WriteSessionState(Connection& connection, const SessionStateRow& row) {
  connection
      .Prepare(
          "INSERT INTO session_states (session_id, revision, state, author, reason, checksum) "
          "VALUES (?,?,?,?,?,?)")
      .Bind(row.session_id)
      .Bind(row.revision)
      .Bind(static_cast<std::int64_t>(row.state))
      .Bind(std::string_view(row.author))
      .Bind(std::string_view(row.reason))
      .Bind(HashOf(row))
      .Run();
}

Result<SessionState> ReadSessionStateAt(Connection& connection,
                                        std::int64_t session_id,
                                        std::uint64_t revision) {
  Query row = connection.Prepare(
      "SELECT session_id, revision, state, author, reason, checksum FROM session_states "
      "WHERE session_id = ? AND revision <= ? ORDER BY revision DESC LIMIT 1");
  row.Bind(session_id).Bind(revision);
  return ReadState(row, session_id);
}

Result<std::optional<SessionStateRow>> FindStateAfter(Connection& connection,
                                                      std::int64_t session_id,
                                                      std::uint64_t revision) {
  Query row = connection.Prepare(
      "SELECT session_id, revision, state, author, reason, checksum FROM session_states "
      "WHERE session_id = ? AND revision > ? ORDER BY revision LIMIT 1");
  row.Bind(session_id).Bind(revision);
  if (!row.Step()) {
    return std::nullopt;
  }
  auto stored = ReadRow(row);
  if (!stored) {
    return Error(stored.error());
  }
  return *std::move(stored);
}

std::uint64_t LastStateChange(Connection& connection, std::int64_t session_id) {
  Query row = connection.Prepare(
      "SELECT coalesce(max(revision), 0) FROM session_states WHERE session_id = ?");
  row.Bind(session_id);
  return row.Step() ? row.Unsigned() : 0;
}

std::vector<std::int64_t> ListSessionsChangedAt(Connection& connection, std::uint64_t revision) {
  Query row = connection.Prepare(
      "SELECT session_id FROM session_states NOT INDEXED WHERE revision = ? ORDER BY session_id");
  row.Bind(revision);
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    ids.push_back(row.Int());
  }
  return ids;
}

Result<std::string> ReadStateReason(Connection& connection, std::int64_t session_id) {
  Query row = connection.Prepare(
      "SELECT session_id, revision, state, author, reason, checksum FROM session_states "
      "WHERE session_id = ? ORDER BY revision DESC LIMIT 1");
  row.Bind(session_id);
  auto stored = ReadOnly(row, session_id);
  if (!stored || stored->state != SessionState::kRetracted) {
    return stored ? Result<std::string>(std::move(stored->reason)) : Error(stored.error());
  }
  const auto before = ReadBeforeRetraction(connection, session_id);
  if (!before || before->state != SessionState::kQuarantined) {
    return before ? Result<std::string>(std::move(stored->reason)) : Error(before.error());
  }
  return StrCat(stored->reason, stored->reason.empty() ? "" : "; ",
                "was quarantined: ", before->reason);
}

Result<SessionState> ReadStateBeforeRetraction(Connection& connection, std::int64_t session_id) {
  const auto before = ReadBeforeRetraction(connection, session_id);
  return before ? Result<SessionState>(before->state) : Error(before.error());
}

Status CheckSessionStates(Connection& connection, std::int64_t session_id, SessionState current) {
  Query row = connection.Prepare(
      "SELECT session_id, revision, state, author, reason, checksum FROM session_states "
      "WHERE session_id = ? ORDER BY revision");
  row.Bind(session_id);
  std::optional<SessionState> last;
  while (row.Step()) {
    const auto stored = ReadRow(row);
    if (!stored) {
      return stored.error();
    }
    if (!last && stored->state == SessionState::kRetracted) {
      return Missing(session_id);  // it was something before
    }
    last = stored->state;
  }
  return last == current ? Status() : Missing(session_id);
}

std::vector<std::int64_t> ListDamagedSessionStates(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT session_id, revision, state, author, reason, checksum, id "
      "FROM session_states NOT INDEXED");
  std::vector<std::int64_t> damaged;
  while (row.Step()) {
    if (!ReadRow(row)) {
      damaged.push_back(row.Int());
    }
  }
  return damaged;
}

bool IsSessionStateUnder(Connection& connection,
                         std::int64_t id,
                         std::int64_t session_id,
                         std::int64_t revision) {
  Query row = connection.Prepare(
      "SELECT ?2, ?3, state, author, reason, checksum FROM session_states WHERE id = ?1");
  row.Bind(id).Bind(session_id).Bind(revision);
  return row.Step() && ReadRow(row).has_value();
}

void DeleteSessionStates(Connection& connection, std::int64_t session_id) {
  connection.Prepare("DELETE FROM session_states WHERE session_id = ?").Bind(session_id).Run();
}

}  // namespace atlas
