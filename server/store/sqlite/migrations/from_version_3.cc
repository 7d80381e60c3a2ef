#include "server/store/sqlite/migrations/from_version_3.h"

#include <cstdint>
#include <string>
#include <string_view>

#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

constexpr const char* kSessions = R"sql(
ALTER TABLE sessions RENAME TO earlier_sessions;

CREATE TABLE sessions (
  id INTEGER PRIMARY KEY,
  vehicle TEXT NOT NULL, session TEXT NOT NULL,
  state INTEGER NOT NULL, state_reason TEXT,
  keyframes INTEGER NOT NULL, bytes INTEGER NOT NULL,
  first_time_ms INTEGER NOT NULL, last_time_ms INTEGER NOT NULL, last_sequence INTEGER NOT NULL,
  compacted INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  UNIQUE (vehicle, session));

INSERT INTO sessions
  SELECT id, vehicle, session, state, state_reason, keyframes, bytes,
    first_time_ms, last_time_ms, last_sequence, 0, checksum
  FROM earlier_sessions;

DROP TABLE earlier_sessions;
)sql";

constexpr const char* kTables = R"sql(
CREATE TABLE IF NOT EXISTS compactions (
  id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL, before_ms INTEGER NOT NULL, author TEXT NOT NULL,
  dropped INTEGER NOT NULL, bytes INTEGER NOT NULL,
  checksum INTEGER NOT NULL);

CREATE TABLE IF NOT EXISTS tombstones (
  session_id INTEGER NOT NULL, sequence INTEGER NOT NULL,
  time_ms INTEGER NOT NULL,
  blob_bytes INTEGER NOT NULL, blob_hash INTEGER NOT NULL,
  compaction_id INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  PRIMARY KEY (session_id, sequence)) WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS tombstones_of_compaction ON tombstones (compaction_id);

CREATE TABLE IF NOT EXISTS starts (
  number INTEGER PRIMARY KEY,
  id BLOB NOT NULL, revision INTEGER NOT NULL,
  checksum INTEGER NOT NULL);
)sql";

bool KnowsCompactions(Connection& connection) {
  return connection.Ask(
             "SELECT count(*) FROM pragma_table_info('sessions') WHERE name = 'compacted'") != 0;
}

// A row's new checksum is the old one's values and one more, 0. That of a damaged row stays, and
// is wrong for the new row as well.
void HashSessionsAgain(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT id, vehicle, session, state, keyframes, bytes, first_time_ms, last_time_ms, "
      "last_sequence, checksum FROM sessions");
  while (row.Step()) {
    row.Rewind();
    const std::int64_t id = row.Int();
    RowHash hash(RowKind::kSession);
    hash.Int(id);
    hash.Text(row.Text());
    hash.Text(row.Text());
    for (int i = 0; i < 6; ++i) {
      hash.Int(row.Int());
    }
    if (hash.value() == row.Int()) {
      connection.Prepare("UPDATE sessions SET checksum = ? WHERE id = ?")
          .Bind(hash.Int(0).value())
          .Bind(id)
          .Run();
    }
  }
}

}  // namespace

void MigrateFromVersion3(Connection& connection) {
  if (!KnowsCompactions(connection)) {
    connection.Execute(kSessions);
    HashSessionsAgain(connection);
  }
  connection.Execute(kTables);
}

}  // namespace atlas
