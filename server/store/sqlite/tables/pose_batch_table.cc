#include "server/store/sqlite/tables/pose_batch_table.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/event_types.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"

#define POSE_BATCH_COLUMNS "id, revision, author, updated, coalesce(if_revision, 0), checksum"

namespace atlas {
namespace {

std::int64_t HashOf(const StoredBatch& batch) {
  return RowHash(RowKind::kPoseBatch)
      .Unsigned(batch.id)
      .Unsigned(batch.revision)
      .Text(batch.author)
      .Unsigned(batch.updated)
      .Unsigned(batch.if_revision)
      .value();
}

struct Row {
  StoredBatch batch;
  std::int64_t checksum = 0;  // as stored
};

// Of POSE_BATCH_COLUMNS. False: it is damaged.
bool ReadIntactRow(Query& query, Row& row) {
  query.Rewind();
  row.batch.id = query.Unsigned();
  row.batch.revision = query.Unsigned();
  row.batch.author = query.Text();
  row.batch.updated = query.Unsigned();
  row.batch.if_revision = query.Unsigned();
  row.checksum = query.Int();
  return query.fits() && row.checksum == HashOf(row.batch);
}

// With which the row is whole.
std::optional<std::uint64_t> IdOneBitAway(Row row) {
  const std::uint64_t stored = row.batch.id;
  for (int bit = 0; bit < 63; ++bit) {
    row.batch.id = stored ^ (std::uint64_t{1} << bit);
    if (HashOf(row.batch) == row.checksum) {
      return row.batch.id;
    }
  }
  return std::nullopt;
}

// The first `most`.
std::vector<Row> ListDamaged(Connection& connection, std::size_t most) {
  Query query = connection.Prepare("SELECT " POSE_BATCH_COLUMNS " FROM pose_batches");
  std::vector<Row> damaged;
  while (damaged.size() < most && query.Step()) {
    if (Row row; !ReadIntactRow(query, row)) {
      damaged.push_back(std::move(row));
    }
  }
  return damaged;
}

Status Damaged(std::uint64_t id) {
  return {StatusCode::kInvalidData,
          StrCat("store: pose batch ", id, " is damaged: wrong checksum")};
}

}  // namespace

void WritePoseBatch(Connection& connection, const StoredBatch& batch) {
  connection
      .Prepare(
          "INSERT INTO pose_batches (id, revision, author, updated, if_revision, checksum) "
          "VALUES (?,?,?,?,?,?)")
      .Bind(batch.id)
      .Bind(batch.revision)
      .Bind(std::string_view(batch.author))
      .Bind(batch.updated)
      .Bind(batch.if_revision)
      .Bind(HashOf(batch))
      .Run();
}

Result<std::optional<StoredBatch>> ReadPoseBatch(Connection& connection, std::uint64_t id) {
  Query query = connection.Prepare("SELECT " POSE_BATCH_COLUMNS " FROM pose_batches WHERE id = ?");
  query.Bind(id);
  if (!query.Step()) {
    return std::nullopt;
  }
  Row row;
  if (!ReadIntactRow(query, row)) {
    return Error(Damaged(id));
  }
  return std::move(row.batch);
}

Status CheckPoseBatches(Connection& connection) {
  const std::vector<Row> damaged = ListDamaged(connection, 1);
  return damaged.empty() ? Status() : Damaged(damaged.front().batch.id);
}

int RepairPoseBatches(Connection& connection) {
  const std::uint64_t most = ReadCounter(connection, Counter::kBatch);
  const std::vector<Row> damaged = ListDamaged(connection, std::numeric_limits<std::size_t>::max());
  for (Row row : damaged) {
    const std::uint64_t stored = row.batch.id;
    if (const auto id = IdOneBitAway(row)) {
      row.batch.id = *id;
    } else if (stored == 0 || stored > most) {
      connection.Prepare("DELETE FROM pose_batches WHERE id = ?").Bind(stored).Run();
      continue;
    } else {
      row.batch.author = kAtlasItself;
      row.batch.revision =
          std::min(row.batch.revision, ReadCounter(connection, Counter::kRevision));
    }
    connection
        .Prepare(
            "UPDATE OR REPLACE pose_batches SET id = ?, revision = ?, author = ?, checksum = ? "
            "WHERE id = ?")
        .Bind(row.batch.id)
        .Bind(row.batch.revision)
        .Bind(std::string_view(row.batch.author))
        .Bind(HashOf(row.batch))
        .Bind(stored)
        .Run();
  }
  return static_cast<int>(damaged.size());
}

}  // namespace atlas
