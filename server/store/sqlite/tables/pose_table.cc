#include "server/store/sqlite/tables/pose_table.h"

#include <cstddef>
#include <string>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/table_sums.h"

namespace atlas {
namespace {

RowHash& AddPose(RowHash& hash, const QuantizedPose& pose) {
  hash.Int(pose.x_um).Int(pose.y_um).Int(pose.z_um);
  for (const std::int32_t part : pose.quaternion) {
    hash.Int(part);
  }
  return hash;
}

Query& BindPose(Query& query, const QuantizedPose& pose) {
  query.Bind(pose.x_um).Bind(pose.y_um).Bind(pose.z_um);
  for (const std::int32_t part : pose.quaternion) {
    query.Bind(part);
  }
  return query;
}

void ReadPoseColumns(Query& row, QuantizedPose& pose) {
  pose.x_um = row.Int();
  pose.y_um = row.Int();
  pose.z_um = row.Int();
  for (std::int32_t& part : pose.quaternion) {
    part = row.Int32();
  }
}

std::int64_t CurrentHash(const PoseChange& change) {
  RowHash hash(RowKind::kPose);
  hash.Int(change.keyframe_id).Unsigned(change.revision).Unsigned(change.batch);
  return AddPose(hash, change.pose).value();
}

std::int64_t HistoryHash(const PoseChange& change) {
  RowHash hash(RowKind::kPoseHistory);
  hash.Int(change.keyframe_id).Unsigned(change.revision).Unsigned(change.batch);
  return AddPose(hash.Text(change.author), change.pose).value();
}

void WriteCurrent(Connection& connection, const PoseChange& change) {
  Query current = connection.Prepare(
      "INSERT OR REPLACE INTO poses (keyframe_id, revision, batch, x_um, y_um, z_um, "
      "qw, qx, qy, qz, checksum) VALUES (?,?,?,?,?,?,?,?,?,?,?)");
  current.Bind(change.keyframe_id).Bind(change.revision).Bind(change.batch);
  BindPose(current, change.pose).Bind(CurrentHash(change)).Run();
}

void AddToHistory(Connection& connection, const PoseChange& change) {
  Query history = connection.Prepare(
      "INSERT INTO pose_history (keyframe_id, revision, batch, author, x_um, y_um, z_um, "
      "qw, qx, qy, qz, checksum) VALUES (?,?,?,?,?,?,?,?,?,?,?,?)");
  history.Bind(change.keyframe_id).Bind(change.revision).Bind(change.batch);
  history.Bind(std::string_view(change.author));
  BindPose(history, change.pose).Bind(HistoryHash(change)).Run();
}

// Columns: keyframe_id, revision, batch, author, x_um, y_um, z_um, qw, qx, qy, qz, checksum.
Result<PoseChange> ReadHistoryRow(Query& row) {
  row.Rewind();
  PoseChange stored;
  stored.keyframe_id = row.Int();
  stored.revision = row.Unsigned();
  stored.batch = row.Unsigned();
  stored.author = row.Text();
  ReadPoseColumns(row, stored.pose);
  if (!row.IsChecksum(HistoryHash(stored))) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the pose of keyframe ", stored.keyframe_id, " at revision ",
                        stored.revision, " is damaged: wrong checksum"));
  }
  return stored;
}

}  // namespace

Result<PoseChange> ReadPoseChange(Connection& connection, std::int64_t keyframe_id) {
  Query row = connection.Prepare(
      "SELECT revision, batch, x_um, y_um, z_um, qw, qx, qy, qz, checksum FROM poses "
      "WHERE keyframe_id = ?");
  row.Bind(keyframe_id);
  if (!row.Step()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the pose of keyframe ", keyframe_id, " is missing"));
  }
  PoseChange stored;
  stored.keyframe_id = keyframe_id;
  stored.revision = row.Unsigned();
  stored.batch = row.Unsigned();
  ReadPoseColumns(row, stored.pose);
  if (!row.IsChecksum(CurrentHash(stored))) {
    return Error(StatusCode::kInvalidData, StrCat("store: the pose of keyframe ", keyframe_id,
                                                  " is damaged: wrong checksum"));
  }
  return stored;
}

Result<QuantizedPose> ReadPose(Connection& connection, std::int64_t keyframe_id) {
  const auto stored = ReadPoseChange(connection, keyframe_id);
  return stored ? Result<QuantizedPose>(stored->pose) : Error(stored.error());
}

Result<std::optional<PoseChange>> ReadPoseChangeAt(Connection& connection,
                                                   std::int64_t keyframe_id,
                                                   std::uint64_t revision) {
  Query row = connection.Prepare(
      "SELECT keyframe_id, revision, batch, author, x_um, y_um, z_um, qw, qx, qy, qz, checksum "
      "FROM pose_history WHERE keyframe_id = ? AND revision <= ? ORDER BY revision DESC LIMIT 1");
  row.Bind(keyframe_id).Bind(revision);
  if (!row.Step()) {
    return std::nullopt;
  }
  auto stored = ReadHistoryRow(row);
  if (!stored) {
    return Error(stored.error());
  }
  return *std::move(stored);
}

Result<std::optional<QuantizedPose>> ReadPoseAt(Connection& connection,
                                                std::int64_t keyframe_id,
                                                std::uint64_t revision) {
  const auto stored = ReadPoseChangeAt(connection, keyframe_id, revision);
  if (!stored) {
    return Error(stored.error());
  }
  return *stored ? std::optional((*stored)->pose) : std::nullopt;
}

Result<std::optional<QuantizedPose>> ReadUploadedPose(Connection& connection,
                                                      std::int64_t keyframe_id) {
  Query row = connection.Prepare(
      "SELECT keyframe_id, revision, batch, author, x_um, y_um, z_um, qw, qx, qy, qz, checksum "
      "FROM pose_history WHERE keyframe_id = ? ORDER BY revision LIMIT 1");
  row.Bind(keyframe_id);
  if (!row.Step()) {
    return std::nullopt;
  }
  const auto stored = ReadHistoryRow(row);
  if (!stored) {
    return Error(stored.error());
  }
  return stored->batch == 0 ? std::optional(stored->pose) : std::nullopt;
}

std::vector<Result<PoseChange>> ReadPoseHistory(Connection& connection, std::int64_t keyframe_id) {
  Query row = connection.Prepare(
      "SELECT keyframe_id, revision, batch, author, x_um, y_um, z_um, qw, qx, qy, qz, checksum "
      "FROM pose_history WHERE keyframe_id = ? ORDER BY revision");
  row.Bind(keyframe_id);
  std::vector<Result<PoseChange>> history;
  while (row.Step()) {
    history.push_back(ReadHistoryRow(row));
  }
  return history;
}

Status CheckPoseHistory(Connection& connection,
                        std::int64_t keyframe_id,
                        const QuantizedPose& current) {
  const auto history = ReadPoseHistory(connection, keyframe_id);
  for (const auto& line : history) {
    if (!line) {
      return line.error();
    }
  }
  if (history.empty() || history.back()->pose != current) {
    return Status(StatusCode::kInvalidData, StrCat("store: the history of keyframe ", keyframe_id,
                                                   " does not end with its pose"));
  }
  return {};
}

void WritePose(Connection& connection, const PoseChange& change) {
  WriteCurrent(connection, change);
  AddToHistory(connection, change);
}

bool RestorePose(Connection& connection, std::int64_t keyframe_id, const std::string& author) {
  const auto current = ReadPoseChange(connection, keyframe_id);
  const PoseChange* last = nullptr;  // that is intact
  std::size_t damaged = 0;
  const auto history = ReadPoseHistory(connection, keyframe_id);
  for (const auto& line : history) {
    damaged += line ? 0U : 1U;
    last = line && (last == nullptr || last->revision < line->revision) ? &*line : last;
  }
  if (!current && damaged == 0 && last != nullptr) {
    WithoutCounting(connection, RowKind::kPose, [&] { WriteCurrent(connection, *last); });
    return true;
  }
  const bool is_last_lost =
      current && (last == nullptr || last->revision < current->revision) && damaged <= 1;
  if (is_last_lost) {
    WithoutCounting(connection, RowKind::kPoseHistory, [&] {
      DeleteDamagedPoses(connection, keyframe_id);
      PoseChange line = *current;
      line.author = author;
      AddToHistory(connection, line);
    });
  }
  return is_last_lost;
}

int DeleteDamagedPoses(Connection& connection, std::int64_t keyframe_id) {
  std::vector<std::int64_t> damaged;
  {
    Query row = connection.Prepare(
        "SELECT keyframe_id, revision, batch, author, x_um, y_um, z_um, qw, qx, qy, qz, checksum, "
        "id FROM pose_history WHERE keyframe_id = ?");
    row.Bind(keyframe_id);
    while (row.Step()) {
      if (!ReadHistoryRow(row)) {
        damaged.push_back(row.Int());
      }
    }
  }
  for (const std::int64_t id : damaged) {
    connection.Prepare("DELETE FROM pose_history WHERE id = ?").Bind(id).Run();
  }
  return static_cast<int>(damaged.size());
}

std::vector<std::int64_t> ListDamagedPoseLines(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT keyframe_id, revision, batch, author, x_um, y_um, z_um, qw, qx, qy, qz, checksum, "
      "id FROM pose_history NOT INDEXED");
  std::vector<std::int64_t> damaged;
  while (row.Step()) {
    if (!ReadHistoryRow(row)) {
      damaged.push_back(row.Int());
    }
  }
  return damaged;
}

bool IsPoseLineUnder(Connection& connection,
                     std::int64_t id,
                     std::int64_t keyframe_id,
                     std::int64_t revision) {
  Query row = connection.Prepare(
      "SELECT ?2, ?3, batch, author, x_um, y_um, z_um, qw, qx, qy, qz, checksum "
      "FROM pose_history WHERE id = ?1");
  row.Bind(id).Bind(keyframe_id).Bind(revision);
  return row.Step() && ReadHistoryRow(row).has_value();
}

void DeletePoses(Connection& connection, std::int64_t keyframe_id) {
  connection.Prepare("DELETE FROM poses WHERE keyframe_id = ?").Bind(keyframe_id).Run();
  connection.Prepare("DELETE FROM pose_history WHERE keyframe_id = ?").Bind(keyframe_id).Run();
}

std::optional<KeyframePlacing> FindPlacedAfter(Connection& connection,
                                               std::int64_t session_id,
                                               std::uint64_t revision) {
  Query row = connection.Prepare(
      "SELECT k.sequence, p.revision, p.batch FROM keyframes k CROSS JOIN poses p "
      "ON p.keyframe_id = k.id WHERE k.session_id = ? AND p.revision > ? "
      "ORDER BY p.revision, k.sequence LIMIT 1");
  row.Bind(session_id).Bind(revision);
  if (!row.Step()) {
    return std::nullopt;
  }
  KeyframePlacing placed;
  placed.sequence = row.Unsigned32();
  placed.revision = row.Unsigned();
  placed.batch = row.Unsigned();
  return placed;
}

std::uint64_t LastPlacing(Connection& connection, std::int64_t session_id) {
  Query row = connection.Prepare(
      "SELECT coalesce(max(p.revision), 0) FROM keyframes k CROSS JOIN poses p "
      "ON p.keyframe_id = k.id WHERE k.session_id = ?");
  row.Bind(session_id);
  return row.Step() ? row.Unsigned() : 0;
}

std::vector<std::int64_t> ListKeyframesOfBatch(Connection& connection, std::uint64_t batch) {
  Query row = connection.Prepare(
      "SELECT DISTINCT keyframe_id FROM pose_history NOT INDEXED WHERE batch = ? "
      "ORDER BY keyframe_id");
  row.Bind(batch);
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    ids.push_back(row.Int());
  }
  return ids;
}

}  // namespace atlas
