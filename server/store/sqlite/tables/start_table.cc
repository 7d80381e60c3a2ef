#include "server/store/sqlite/tables/start_table.h"

#include <algorithm>
#include <cstdint>

#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

constexpr std::int64_t kRemembered = 100;

std::int64_t HashOf(std::int64_t number, ByteSpan id, std::uint64_t revision) {
  return RowHash(RowKind::kStart).Int(number).Raw(id).Unsigned(revision).value();
}

bool IsNoted(Connection& connection) {
  Query last = connection.Prepare("SELECT id FROM starts ORDER BY number DESC LIMIT 1");
  const ByteSpan id = connection.id();
  if (!last.Step()) {
    return false;
  }
  const Bytes noted = last.Blob();
  return std::equal(noted.begin(), noted.end(), id.begin(), id.end());
}

void NoteStart(Connection& connection) {
  const ByteSpan id = connection.id();
  const std::uint64_t revision = ReadCounter(connection, Counter::kRevision);
  const std::int64_t number = 1 + connection.Ask("SELECT coalesce(max(number), 0) FROM starts");
  connection.Prepare("INSERT INTO starts (number, id, revision, checksum) VALUES (?,?,?,?)")
      .Bind(number)
      .Bind(id)
      .Bind(revision)
      .Bind(HashOf(number, id, revision))
      .Run();
  connection.Prepare("DELETE FROM starts WHERE number <= ?").Bind(number - kRemembered).Run();
}

}  // namespace

std::uint64_t NextRevision(Connection& connection) {
  if (!IsNoted(connection)) {
    NoteStart(connection);
  }
  return AddToCounter(connection, Counter::kRevision, 1);
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
    if (id.size() != start.id.size() || !row.IsChecksum(HashOf(number, id, start.revision))) {
      starts.clear();
      continue;
    }
    std::copy(id.begin(), id.end(), start.id.begin());
    starts.push_back(start);
  }
  return starts;
}

Status CheckStarts(Connection& connection) {
  const auto rows = static_cast<std::size_t>(connection.Ask("SELECT count(*) FROM starts"));
  return ReadStarts(connection).size() == rows
             ? Status()
             : Status(StatusCode::kInvalidData, "store: a start is damaged: wrong checksum");
}

int DropUnknownStarts(Connection& connection) {
  std::int64_t last = 0;
  bool is_damaged = false;
  {
    Query row =
        connection.Prepare("SELECT number, id, revision, checksum FROM starts ORDER BY number");
    while (row.Step()) {
      row.Rewind();
      const std::int64_t number = row.Int();
      const Bytes id = row.Blob();
      const std::uint64_t revision = row.Unsigned();
      if (id.size() != AtlasStart().id.size() || !row.IsChecksum(HashOf(number, id, revision))) {
        last = number;
        is_damaged = true;
      }
    }
  }
  return is_damaged ? connection.Prepare("DELETE FROM starts WHERE number <= ?").Bind(last).Run()
                    : 0;
}

}  // namespace atlas
