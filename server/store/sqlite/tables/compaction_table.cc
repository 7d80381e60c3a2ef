#include "server/store/sqlite/tables/compaction_table.h"

#include <map>
#include <string_view>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

std::int64_t HashOf(const TombstoneRow& row) {
  return RowHash(RowKind::kTombstone)
      .Int(row.session_id)
      .Int(row.sequence)
      .Int(row.time_ms)
      .Int(row.blob_bytes)
      .Unsigned(row.blob_hash)
      .Int(row.compaction_id)
      .value();
}

// Columns: id, revision, before_ms, author, dropped, bytes, checksum.
Result<CompactionRow> ReadCompaction(Query& row) {
  row.Rewind();
  CompactionRow result;
  result.id = row.Int();
  result.revision = row.Unsigned();
  result.before_ms = row.Int();
  result.author = row.Text();
  result.dropped = row.Unsigned();
  result.bytes = row.Unsigned();
  if (!row.IsChecksum(HashOf(result))) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the row of compaction ", result.id, " is damaged: wrong checksum"));
  }
  return result;
}

// Columns: session_id, sequence, time_ms, blob_bytes, blob_hash, compaction_id, checksum.
Result<TombstoneRow> ReadTombstone(Query& row) {
  row.Rewind();
  TombstoneRow result;
  result.session_id = row.Int();
  result.sequence = row.Unsigned32();
  result.time_ms = row.Int();
  result.blob_bytes = row.Unsigned32();
  result.blob_hash = row.Unsigned();
  result.compaction_id = row.Int();
  if (!row.IsChecksum(HashOf(result))) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the tombstone of keyframe ", result.sequence, " of session ",
                        result.session_id, " is damaged: wrong checksum"));
  }
  return result;
}

Result<CompactionRow> ReadCompactionRow(Connection& connection, std::int64_t id) {
  Query row = connection.Prepare(
      "SELECT id, revision, before_ms, author, dropped, bytes, checksum FROM compactions "
      "WHERE id = ?");
  row.Bind(id);
  if (!row.Step()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the row of compaction ", id, " is missing"));
  }
  return ReadCompaction(row);
}

// The number of a row that is damaged, with which it is whole.
std::optional<std::int64_t> OwnNumber(Connection& connection, std::int64_t number) {
  Query query = connection.Prepare(
      "SELECT id, revision, before_ms, author, dropped, bytes, checksum FROM compactions "
      "WHERE id = ?");
  query.Bind(number);
  if (!query.Step()) {
    return std::nullopt;
  }
  CompactionRow row{query.Int(),  query.Unsigned(), query.Int(),
                    query.Text(), query.Unsigned(), query.Unsigned()};
  const std::int64_t checksum = query.Int();
  for (int bit = 0; query.fits() && bit < 63; ++bit) {
    row.id = number ^ (std::int64_t{1} << bit);
    if (HashOf(row) == checksum) {
      return row.id;
    }
  }
  return std::nullopt;
}

// What a session lost to a compaction.
struct Loss {
  std::uint64_t dropped = 0;
  std::uint64_t bytes = 0;
};

// By compaction.
Result<std::map<std::int64_t, Loss>> SumTombstones(Connection& connection,
                                                   std::int64_t session_id) {
  Query row = connection.Prepare(
      "SELECT session_id, sequence, time_ms, blob_bytes, blob_hash, compaction_id, checksum "
      "FROM tombstones WHERE session_id = ?");
  row.Bind(session_id);
  std::map<std::int64_t, Loss> losses;
  while (row.Step()) {
    const auto tombstone = ReadTombstone(row);
    if (!tombstone) {
      return Error(tombstone.error());
    }
    Loss& loss = losses[tombstone->compaction_id];
    ++loss.dropped;
    loss.bytes += tombstone->blob_bytes;
  }
  return losses;
}

std::uint64_t CountTombstones(Connection& connection, std::int64_t compaction_id) {
  Query row = connection.Prepare("SELECT count(*) FROM tombstones WHERE compaction_id = ?");
  row.Bind(compaction_id);
  return row.Step() ? row.Unsigned() : 0;
}

}  // namespace

std::int64_t HashOf(const CompactionRow& row) {
  return RowHash(RowKind::kCompaction)
      .Int(row.id)
      .Unsigned(row.revision)
      .Int(row.before_ms)
      .Text(row.author)
      .Unsigned(row.dropped)
      .Unsigned(row.bytes)
      .value();
}

std::int64_t TakeCompactionNumber(Connection& connection) {
  constexpr const char* kFind = "SELECT 1 FROM compactions WHERE id = ?";
  const auto next = static_cast<std::int64_t>(ReadCounter(connection, Counter::kCompactions)) + 1;
  if (const auto own = OwnNumber(connection, next)) {
    connection.Prepare("UPDATE OR IGNORE compactions SET id = ? WHERE id = ?")
        .Bind(*own)
        .Bind(next)
        .Run();
  }
  return static_cast<std::int64_t>(TakeNumber(connection, Counter::kCompactions, kFind));
}

void WriteCompaction(Connection& connection, const CompactionRow& row) {
  connection
      .Prepare(
          "INSERT INTO compactions (id, revision, before_ms, author, dropped, bytes, checksum) "
          "VALUES (?,?,?,?,?,?,?)")
      .Bind(row.id)
      .Bind(row.revision)
      .Bind(row.before_ms)
      .Bind(std::string_view(row.author))
      .Bind(row.dropped)
      .Bind(row.bytes)
      .Bind(HashOf(row))
      .Run();
}

void WriteTombstone(Connection& connection, const TombstoneRow& row) {
  connection
      .Prepare(
          "INSERT INTO tombstones (session_id, sequence, time_ms, blob_bytes, blob_hash, "
          "compaction_id, checksum) VALUES (?,?,?,?,?,?,?)")
      .Bind(row.session_id)
      .Bind(row.sequence)
      .Bind(row.time_ms)
      .Bind(row.blob_bytes)
      .Bind(row.blob_hash)
      .Bind(row.compaction_id)
      .Bind(HashOf(row))
      .Run();
}

Result<std::optional<TombstoneRow>> FindTombstone(Connection& connection,
                                                  std::int64_t session_id,
                                                  std::uint32_t sequence) {
  Query row = connection.Prepare(
      "SELECT session_id, sequence, time_ms, blob_bytes, blob_hash, compaction_id, checksum "
      "FROM tombstones WHERE session_id = ? AND sequence = ?");
  row.Bind(session_id).Bind(sequence);
  if (!row.Step()) {
    return std::nullopt;
  }
  auto tombstone = ReadTombstone(row);
  if (!tombstone) {
    return Error(tombstone.error());
  }
  return *tombstone;
}

std::uint64_t LastCompactionOf(Connection& connection, std::int64_t session_id) {
  Query row = connection.Prepare(
      "SELECT coalesce(max(c.revision), 0) FROM compactions c WHERE EXISTS "
      "(SELECT 1 FROM tombstones t WHERE t.compaction_id = c.id AND t.session_id = ?)");
  row.Bind(session_id);
  return row.Step() ? row.Unsigned() : 0;
}

bool HasTombstoneBetween(Connection& connection,
                         std::int64_t session_id,
                         std::uint32_t after,
                         std::uint32_t before) {
  Query row = connection.Prepare(
      "SELECT 1 FROM tombstones WHERE session_id = ? AND sequence > ? AND sequence < ? LIMIT 1");
  row.Bind(session_id).Bind(after).Bind(before);
  return row.Step();
}

Result<std::uint64_t> DeleteTombstones(Connection& connection, std::int64_t session_id) {
  const auto losses = SumTombstones(connection, session_id);
  if (!losses) {
    return Error(losses.error());
  }
  std::uint64_t deleted = 0;
  for (const auto& [compaction_id, loss] : *losses) {
    auto compaction = ReadCompactionRow(connection, compaction_id);
    if (!compaction) {
      return Error(compaction.error());
    }
    compaction->dropped -= loss.dropped;
    compaction->bytes -= loss.bytes;
    DeleteCompaction(connection, compaction_id);
    WriteCompaction(connection, *compaction);
    deleted += loss.dropped;
  }
  connection.Prepare("DELETE FROM tombstones WHERE session_id = ?").Bind(session_id).Run();
  return deleted;
}

Status CheckTombstones(Connection& connection, std::int64_t session_id, std::uint64_t expected) {
  Query row = connection.Prepare(
      "SELECT session_id, sequence, time_ms, blob_bytes, blob_hash, compaction_id, checksum "
      "FROM tombstones WHERE session_id = ? ORDER BY sequence");
  row.Bind(session_id);
  std::uint64_t found = 0;
  while (row.Step()) {
    const auto tombstone = ReadTombstone(row);
    if (!tombstone) {
      return tombstone.error();
    }
    ++found;
  }
  return found == expected
             ? Status()
             : Status(StatusCode::kInvalidData,
                      StrCat("store: session ", session_id, " counts ", expected,
                             " dropped keyframes, and ", found, " tombstones are there"));
}

std::vector<TombstoneKey> ListDamagedTombstones(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT session_id, sequence, time_ms, blob_bytes, blob_hash, compaction_id, checksum "
      "FROM tombstones");
  std::vector<TombstoneKey> damaged;
  while (row.Step()) {
    if (!ReadTombstone(row)) {
      row.Rewind();
      damaged.push_back({row.Int(), row.Int()});
    }
  }
  return damaged;
}

void DeleteTombstone(Connection& connection, const TombstoneKey& key) {
  connection.Prepare("DELETE FROM tombstones WHERE session_id = ? AND sequence = ?")
      .Bind(key.session_id)
      .Bind(key.sequence)
      .Run();
}

std::vector<StoredCompaction> ListCompactions(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT id, revision, before_ms, author, dropped, bytes, checksum, "
      "(SELECT count(*) FROM tombstones WHERE compaction_id = id), "
      "(SELECT coalesce(sum(blob_bytes), 0) FROM tombstones WHERE compaction_id = id) "
      "FROM compactions ORDER BY id");
  std::vector<StoredCompaction> compactions;
  while (row.Step()) {
    row.Rewind();
    StoredCompaction stored;
    CompactionRow& r = stored.row;
    r = {row.Int(), row.Unsigned(), row.Int(), row.Text(), row.Unsigned(), row.Unsigned()};
    stored.checksum = row.Int();
    stored.fits = row.fits();
    stored.tombstones = row.Unsigned();
    stored.tombstone_bytes = row.Unsigned();
    compactions.push_back(std::move(stored));
  }
  return compactions;
}

void DeleteCompaction(Connection& connection, std::int64_t id) {
  connection.Prepare("DELETE FROM compactions WHERE id = ?").Bind(id).Run();
}

Status CheckCompactionRows(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT id, revision, before_ms, author, dropped, bytes, checksum FROM compactions "
      "ORDER BY id");
  while (row.Step()) {
    const auto compaction = ReadCompaction(row);
    if (!compaction) {
      return compaction.error();
    }
    const std::uint64_t tombstones = CountTombstones(connection, compaction->id);
    if (tombstones != compaction->dropped) {
      return Status(StatusCode::kInvalidData,
                    StrCat("store: compaction ", compaction->id, " dropped ", compaction->dropped,
                           " keyframes, and ", tombstones, " tombstones are there"));
    }
  }
  return {};
}

}  // namespace atlas
