#include "server/store/sqlite/tables/start_table.h"

#include <algorithm>
#include <cstdint>
#include <random>

#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

constexpr std::int64_t kRemembered = 100;

std::int64_t HashOf(std::int64_t number, ByteSpan id, std::uint64_t revision) {
  return RowHash(RowKind::kStart).Int(number).Raw(id).Unsigned(revision).value();
}

std::vector<AtlasStart> ReadStarts(Connection& connection) {
  Query row =
      connection.Prepare("SELECT number, id, revision, checksum FROM starts ORDER BY number");
  std::vector<AtlasStart> starts;
  while (row.Step()) {
    row.Rewind();
    const std::int64_t number = row.Int();
    const Bytes id = row.Blob();
    AtlasStart start;
    start.revision = row.Unsigned();
    if (id.size() != start.id.size() || row.Int() != HashOf(number, id, start.revision)) {
      starts.clear();
      continue;
    }
    std::copy(id.begin(), id.end(), start.id.begin());
    starts.push_back(start);
  }
  return starts;
}

void InsertStart(Connection& connection) {
  AtlasStart now;
  std::random_device random;
  std::generate(now.id.begin(), now.id.end(),
                [&random] { return static_cast<std::uint8_t>(random()); });
  connection.Execute(
      "BEGIN IMMEDIATE; CREATE TABLE IF NOT EXISTS starts (number INTEGER PRIMARY KEY, "
      "id BLOB NOT NULL, revision INTEGER NOT NULL, checksum INTEGER NOT NULL)");
  now.revision = ReadCounter(connection, Counter::kRevision);
  const std::int64_t number = 1 + connection.Ask("SELECT coalesce(max(number), 0) FROM starts");
  connection.Prepare("INSERT INTO starts (number, id, revision, checksum) VALUES (?,?,?,?)")
      .Bind(number)
      .Bind(ByteSpan(now.id))
      .Bind(now.revision)
      .Bind(HashOf(number, now.id, now.revision))
      .Run();
  connection.Prepare("DELETE FROM starts WHERE number <= ?").Bind(number - kRemembered).Run();
  connection.Execute("COMMIT");
}

}  // namespace

std::vector<AtlasStart> AddStart(Connection& connection) {
  try {
    InsertStart(connection);
    return ReadStarts(connection);
  } catch (const SQLite::Exception&) {
    if (connection.is_in_transaction()) {
      connection.Execute("ROLLBACK");
    }
    return {};
  }
}

}  // namespace atlas
