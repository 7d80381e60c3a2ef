#include "server/store/sqlite/tables/keyframe_table.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/compaction_table.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_row.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_state_table.h"
#include "server/store/sqlite/tables/session_table.h"
#include "server/store/tile_ranges.h"

namespace atlas {
namespace {

std::vector<std::int64_t> ReadIds(Query& row) {
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    ids.push_back(row.Int());
  }
  return ids;
}

void BindPrior(Query& query, const std::optional<PositionPrior>& prior) {
  if (prior) {
    query.Bind(prior->x_um).Bind(prior->y_um).Bind(prior->z_um).Bind(prior->radius_mm);
  } else {
    query.BindNull().BindNull().BindNull().BindNull();
  }
}

// `sql` names the columns in the order of the table.
void WriteRow(Connection& connection,
              const char* sql,
              const NewKeyframe& keyframe,
              std::int64_t id,
              std::int64_t session_id,
              std::uint64_t revision) {
  FullKeyframeRow row;
  row.row.record = {
      id, keyframe.key, keyframe.time_ms, keyframe.grid, keyframe.level_quaternion, {}, {}};
  row.row.session_id = session_id;
  row.row.blob_hash = Hash64(keyframe.blob);
  row.row.blob_bytes = static_cast<std::uint32_t>(keyframe.blob.size());
  row.shard = keyframe.footprint.empty() ? 0 : ShardOf(keyframe.footprint.front());
  row.revision = revision;
  row.prior = keyframe.prior;
  Query query = connection.Prepare(sql);
  query.Bind(id).Bind(row.shard);
  query.Bind(session_id).Bind(keyframe.key.sequence).Bind(keyframe.time_ms).Bind(revision);
  query.Bind(keyframe.grid.cell_size_um).Bind(keyframe.grid.radius_cells);
  for (const std::int32_t part : keyframe.level_quaternion) {
    query.Bind(part);
  }
  BindPrior(query, keyframe.prior);
  query.Bind(row.row.blob_bytes)
      .Bind(row.row.blob_hash)
      .Bind(HashOf(row))
      .Bind(ByteSpan(keyframe.blob));
  query.Run();
}

}  // namespace

Result<std::optional<KeyframeRow>> FindKeyframeRow(Connection& connection,
                                                   std::int64_t session_id,
                                                   std::uint32_t sequence) {
  Query row = connection.Prepare("SELECT " KEYFRAME_COLUMNS
                                 " FROM keyframes WHERE session_id = ? AND sequence = ?");
  row.Bind(session_id).Bind(sequence);
  if (!row.Step()) {
    return std::nullopt;
  }
  auto result = ReadFullKeyframeRow(row);
  if (!result) {
    return Error(result.error());
  }
  return std::move(result->row);
}

Result<KeyframeRow> ReadKeyframeRow(Connection& connection, std::int64_t id) {
  Query row = connection.Prepare("SELECT " KEYFRAME_COLUMNS " FROM keyframes WHERE id = ?");
  row.Bind(id);
  if (!row.Step()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the row of keyframe ", id, " is missing"));
  }
  auto result = ReadFullKeyframeRow(row);
  return result ? Result<KeyframeRow>(std::move(result->row)) : Error(result.error());
}

Result<KeyframeRecord> ReadKeyframeRecord(Connection& connection, std::int64_t id) {
  auto row = ReadKeyframeRow(connection, id);
  if (!row) {
    return Error(row.error());
  }
  const auto session = ReadSession(connection, row->session_id);
  if (!session) {
    return Error(session.error());
  }
  const auto pose = ReadPose(connection, id);
  if (!pose) {
    return Error(pose.error());
  }
  row->record.key.session = session->record.key;
  row->record.pose = *pose;
  row->record.session_state = session->record.state;
  return std::move(row->record);
}

Result<KeyframeRecord> VerifyKeyframeRecord(Connection& connection, std::int64_t id) {
  auto record = ReadKeyframeRecord(connection, id);
  if (!record) {
    return record;
  }
  if (Status status = CheckPoseHistory(connection, id, record->pose); !status.ok()) {
    return Error(std::move(status));
  }
  if (Status status = CheckFootprint(connection, id, LastChange(connection, id)); !status.ok()) {
    return Error(std::move(status));
  }
  return record;
}

Result<std::optional<KeyframeRecord>> ReadKeyframeRecordAt(Connection& connection,
                                                           std::int64_t id,
                                                           std::uint64_t revision) {
  const auto pose = ReadPoseAt(connection, id, revision);
  if (!pose) {
    return Error(pose.error());
  }
  if (!*pose) {
    return std::nullopt;
  }
  auto row = ReadKeyframeRow(connection, id);
  if (!row) {
    return Error(row.error());
  }
  const auto session = ReadSession(connection, row->session_id);
  if (!session) {
    return Error(session.error());
  }
  const auto state = ReadSessionStateAt(connection, row->session_id, revision);
  if (!state) {
    return Error(state.error());
  }
  row->record.key.session = session->record.key;
  row->record.pose = **pose;
  row->record.session_state = *state;
  return std::move(row->record);
}

Result<std::optional<KeyframeRecord>> FindKeyframeRecord(Connection& connection,
                                                         const KeyframeKey& key) {
  const auto session = FindSession(connection, key.session);
  if (!session) {
    return Error(session.error());
  }
  const Status unknown(StatusCode::kNotFound, StrCat("keyframe ", key, " is not in the atlas"));
  if (!*session) {
    return Error(unknown);
  }
  const auto row = FindKeyframeRow(connection, (*session)->id, key.sequence);
  if (!row) {
    return Error(row.error());
  }
  if (*row) {
    return ReadKeyframeRecord(connection, (*row)->record.id);
  }
  const auto tombstone = FindTombstone(connection, (*session)->id, key.sequence);
  if (!tombstone) {
    return Error(tombstone.error());
  }
  return *tombstone ? Result<std::optional<KeyframeRecord>>(std::nullopt) : Error(unknown);
}

Result<Bytes> ReadBlob(Connection& connection, std::int64_t id) {
  const auto row = ReadKeyframeRow(connection, id);
  if (!row) {
    return Error(row.error());
  }
  Bytes blob = ReadBlobUnchecked(connection, id);
  if (blob.size() != row->blob_bytes || Hash64(blob) != row->blob_hash) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the blob of keyframe ", id, " is damaged: wrong checksum"));
  }
  return blob;
}

std::int64_t FindKeyframeId(Connection& connection,
                            std::int64_t session_id,
                            std::uint32_t sequence) {
  Query row = connection.Prepare("SELECT id FROM keyframes WHERE session_id = ? AND sequence = ?");
  row.Bind(session_id).Bind(sequence);
  return row.Step() ? row.Int() : 0;
}

std::vector<std::int64_t> ListSessionKeyframes(Connection& connection, std::int64_t session_id) {
  Query row = connection.Prepare("SELECT id FROM keyframes WHERE session_id = ? ORDER BY sequence");
  row.Bind(session_id);
  return ReadIds(row);
}

std::vector<std::int64_t> ListKeyframesBefore(Connection& connection,
                                              std::int64_t session_id,
                                              std::uint32_t sequence,
                                              std::size_t count) {
  Query row = connection.Prepare(
      "SELECT id FROM keyframes WHERE session_id = ? AND sequence < ? "
      "ORDER BY sequence DESC LIMIT ?");
  row.Bind(session_id).Bind(sequence).Bind(count);
  std::vector<std::int64_t> ids = ReadIds(row);
  std::reverse(ids.begin(), ids.end());
  return ids;
}

std::vector<std::int64_t> ListKeyframesBehind(Connection& connection,
                                              std::int64_t session_id,
                                              std::int64_t sequence,
                                              std::size_t count) {
  Query row = connection.Prepare(
      "SELECT id FROM keyframes WHERE session_id = ? AND sequence > ? ORDER BY sequence LIMIT ?");
  row.Bind(session_id).Bind(sequence).Bind(count);
  return ReadIds(row);
}

Result<std::vector<IndexedKeyframe>> ListIndexedBehind(Connection& connection,
                                                       std::int64_t session_id,
                                                       std::int64_t sequence,
                                                       std::size_t count) {
  Query row = connection.Prepare(
      "SELECT id, sequence FROM keyframes INDEXED BY sqlite_autoindex_keyframes_1 "
      "WHERE session_id = ? AND sequence > ? ORDER BY sequence LIMIT ?");
  row.Bind(session_id).Bind(sequence).Bind(count);
  std::vector<IndexedKeyframe> keyframes;
  for (std::int64_t last = sequence; row.Step(); last = keyframes.back().sequence) {
    row.Rewind();
    IndexedKeyframe entry;
    entry.id = row.Int();
    entry.sequence = row.Unsigned32();
    if (!row.fits() || entry.sequence <= last) {
      return Error(StatusCode::kInvalidData,
                   StrCat("store: the index of keyframes is damaged at keyframe ", entry.id));
    }
    keyframes.push_back(entry);
  }
  return keyframes;
}

Status CheckKeyframe(Connection& connection, std::int64_t id) {
  const auto record = ReadKeyframeRecord(connection, id);
  if (!record) {
    return record.error();
  }
  const auto blob = ReadBlob(connection, id);
  if (!blob) {
    return blob.error();
  }
  return StatusOf([&]() -> Status {
    ReadFootprint(connection, id);
    return {};
  });
}

std::uint64_t LastChange(Connection& connection, std::int64_t id) {
  Query row = connection.Prepare(
      "SELECT max(revision) FROM (SELECT revision FROM pose_history WHERE keyframe_id = ? "
      "UNION ALL SELECT s.revision FROM session_states s JOIN keyframes k "
      "ON k.session_id = s.session_id WHERE k.id = ?)");
  row.Bind(id).Bind(id);
  return row.Step() ? row.Unsigned() : 0;
}

Bytes ReadBlobUnchecked(Connection& connection, std::int64_t id) {
  Query query = connection.Prepare("SELECT blob FROM keyframes WHERE id = ?");
  query.Bind(id);
  return query.Step() ? query.Blob() : Bytes();
}

void InsertKeyframe(Connection& connection,
                    const NewKeyframe& keyframe,
                    std::int64_t id,
                    std::int64_t session_id,
                    std::uint64_t revision) {
  WriteRow(connection,
           "INSERT INTO keyframes (id, shard, session_id, sequence, time_ms, revision, "
           "cell_size_um, radius_cells, level_qw, level_qx, level_qy, level_qz, prior_x_um, "
           "prior_y_um, prior_z_um, prior_radius_mm, blob_bytes, blob_hash, checksum, blob) "
           "VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)",
           keyframe, id, session_id, revision);
}

void RestoreKeyframe(Connection& connection,
                     const NewKeyframe& keyframe,
                     std::int64_t id,
                     std::int64_t session_id,
                     std::uint64_t revision) {
  WithoutCounting(connection, RowKind::kKeyframe, [&] {
    WriteRow(connection,
             "INSERT OR REPLACE INTO keyframes (id, shard, session_id, sequence, time_ms, "
             "revision, cell_size_um, radius_cells, level_qw, level_qx, level_qy, level_qz, "
             "prior_x_um, prior_y_um, prior_z_um, prior_radius_mm, blob_bytes, blob_hash, "
             "checksum, blob) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)",
             keyframe, id, session_id, revision);
  });
}

void DeleteKeyframe(Connection& connection, std::int64_t id) {
  connection.Prepare("DELETE FROM keyframes WHERE id = ?").Bind(id).Run();
}

}  // namespace atlas
