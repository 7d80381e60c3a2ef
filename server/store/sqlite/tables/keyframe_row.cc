#include "server/store/sqlite/tables/keyframe_row.h"

#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

void AddCommon(RowHash& hash, const KeyframeRow& row) {
  hash.Int(row.record.id).Int(row.session_id).Int(row.record.key.sequence).Int(row.record.time_ms);
  hash.Int(row.record.grid.cell_size_um).Int(row.record.grid.radius_cells);
  for (const std::int32_t part : row.record.level_quaternion) {
    hash.Int(part);
  }
  hash.Int(row.blob_bytes).Unsigned(row.blob_hash);
}

// Of rows that earlier versions of the schema wrote: to write them anew is to write their blobs.
std::int64_t FormerHashOf(const FullKeyframeRow& row) {
  RowHash hash(RowKind::kFormerKeyframe);
  AddCommon(hash, row.row);
  return hash.value();
}

// As its columns have it.
struct StoredRow {
  FullKeyframeRow row;
  std::int64_t checksum = 0;
  bool fits = true;  // no column was cut
};

StoredRow ReadColumns(Query& query) {
  StoredRow stored;
  FullKeyframeRow& row = stored.row;
  KeyframeRecord& r = row.row.record;
  r.id = query.Int();
  row.row.session_id = query.Int();
  r.key.sequence = query.Unsigned32();
  r.time_ms = query.Int();
  r.grid.cell_size_um = query.Unsigned32();
  r.grid.radius_cells = query.Int32();
  for (std::int32_t& part : r.level_quaternion) {
    part = query.Int32();
  }
  row.row.blob_bytes = query.Unsigned32();
  row.row.blob_hash = query.Unsigned();
  row.shard = query.Int();
  row.revision = query.Unsigned();
  const bool has_prior = query.Bool();
  const PositionPrior prior{query.Int(), query.Int(), query.Int(), query.Unsigned32()};
  row.prior = has_prior ? std::optional(prior) : std::nullopt;
  stored.checksum = query.Int();
  stored.fits = query.fits();
  return stored;
}

bool IsIntact(const StoredRow& stored) {
  return stored.fits &&
         (stored.checksum == HashOf(stored.row) || stored.checksum == FormerHashOf(stored.row));
}

// The number with which the row is whole, if it is that or one bit away from it; else its own.
std::int64_t TellNumber(StoredRow stored) {
  std::int64_t& id = stored.row.row.record.id;
  const std::int64_t own = id;
  for (int bit = 0; stored.fits && !IsIntact(stored) && bit < 63; ++bit) {
    id = own ^ (std::int64_t{1} << bit);
  }
  return IsIntact(stored) ? id : own;
}

}  // namespace

std::int64_t HashOf(const FullKeyframeRow& row) {
  RowHash hash(RowKind::kKeyframe);
  AddCommon(hash, row.row);
  hash.Int(row.shard).Unsigned(row.revision).Int(row.prior ? 1 : 0);
  const PositionPrior prior = row.prior.value_or(PositionPrior{});
  return hash.Int(prior.x_um).Int(prior.y_um).Int(prior.z_um).Int(prior.radius_mm).value();
}

Result<FullKeyframeRow> ReadFullKeyframeRow(Query& query) {
  StoredRow stored = ReadColumns(query);
  if (!IsIntact(stored)) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the row of keyframe ", stored.row.row.record.id,
                        " is damaged: wrong checksum"));
  }
  return std::move(stored.row);
}

Result<FullKeyframeRow> ReadFullKeyframeRow(Connection& connection, std::int64_t id) {
  Query row = connection.Prepare("SELECT " KEYFRAME_COLUMNS " FROM keyframes WHERE id = ?");
  row.Bind(id);
  if (!row.Step()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the row of keyframe ", id, " is missing"));
  }
  return ReadFullKeyframeRow(row);
}

std::vector<std::int64_t> ListDamagedKeyframeRows(Connection& connection) {
  Query row = connection.Prepare("SELECT " KEYFRAME_COLUMNS " FROM keyframes NOT INDEXED");
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    if (!ReadFullKeyframeRow(row)) {
      row.Rewind();
      ids.push_back(row.Int());
    }
  }
  return ids;
}

std::vector<std::int64_t> TellKeyframeNumbers(Connection& connection) {
  Query row = connection.Prepare("SELECT " KEYFRAME_COLUMNS " FROM keyframes NOT INDEXED");
  std::vector<std::int64_t> numbers;
  while (row.Step()) {
    row.Rewind();
    numbers.push_back(TellNumber(ReadColumns(row)));
  }
  return numbers;
}

bool IsKeyframeRowUnder(Connection& connection,
                        std::int64_t id,
                        std::int64_t session_id,
                        std::int64_t sequence) {
  Query row = connection.Prepare("SELECT id, ?2, ?3, " KEYFRAME_COLUMNS_BEHIND_ITS_KEY
                                 " FROM keyframes WHERE id = ?1");
  row.Bind(id).Bind(session_id).Bind(sequence);
  return row.Step() && ReadFullKeyframeRow(row).has_value();
}

bool IsKeyframeRowOf(Connection& connection, std::int64_t id, std::int64_t other) {
  Query row = connection.Prepare("SELECT ?2, session_id, sequence, " KEYFRAME_COLUMNS_BEHIND_ITS_KEY
                                 " FROM keyframes WHERE id = ?1");
  row.Bind(id).Bind(other);
  return row.Step() && ReadFullKeyframeRow(row).has_value();
}

Result<NewKeyframe> ReadUploadedKeyframe(Connection& connection, std::int64_t id) {
  const auto row = ReadFullKeyframeRow(connection, id);
  if (!row) {
    return Error(row.error());
  }
  auto blob = ReadBlob(connection, id);
  if (!blob) {
    return Error(blob.error());
  }
  const KeyframeRecord& record = row->row.record;
  NewKeyframe keyframe;
  keyframe.key = record.key;
  keyframe.time_ms = record.time_ms;
  keyframe.grid = record.grid;
  keyframe.level_quaternion = record.level_quaternion;
  keyframe.prior = row->prior;
  keyframe.blob = *std::move(blob);
  return keyframe;
}

Status MoveKeyframeRow(Connection& connection, std::int64_t id, std::int64_t session_id) {
  auto row = ReadFullKeyframeRow(connection, id);
  if (!row) {
    return row.error();
  }
  row->row.session_id = session_id;
  connection.Prepare("UPDATE keyframes SET session_id = ?, checksum = ? WHERE id = ?")
      .Bind(session_id)
      .Bind(HashOf(*row))
      .Bind(id)
      .Run();
  return {};
}

}  // namespace atlas
