#include "server/store/sqlite/pose_table.h"

#include <array>

#include "core/base/str_cat.h"
#include "server/store/sqlite/row_hash.h"

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

}  // namespace

Result<QuantizedPose> ReadPose(Connection& connection, std::int64_t keyframe_id) {
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
  stored.pose.x_um = row.Int();
  stored.pose.y_um = row.Int();
  stored.pose.z_um = row.Int();
  for (std::int32_t& part : stored.pose.quaternion) {
    part = row.Int32();
  }
  if (row.Int() != CurrentHash(stored)) {
    return Error(StatusCode::kInvalidData, StrCat("store: the pose of keyframe ", keyframe_id,
                                                  " is damaged: wrong checksum"));
  }
  return stored.pose;
}

void WritePose(Connection& connection, const PoseChange& change) {
  Query current = connection.Prepare(
      "INSERT OR REPLACE INTO poses (keyframe_id, revision, batch, x_um, y_um, z_um, "
      "qw, qx, qy, qz, checksum) VALUES (?,?,?,?,?,?,?,?,?,?,?)");
  current.Bind(change.keyframe_id).Bind(change.revision).Bind(change.batch);
  BindPose(current, change.pose).Bind(CurrentHash(change)).Run();
  Query history = connection.Prepare(
      "INSERT INTO pose_history (keyframe_id, revision, batch, author, x_um, y_um, z_um, "
      "qw, qx, qy, qz, checksum) VALUES (?,?,?,?,?,?,?,?,?,?,?,?)");
  history.Bind(change.keyframe_id).Bind(change.revision).Bind(change.batch).Bind(change.author);
  BindPose(history, change.pose).Bind(HistoryHash(change)).Run();
}

void WritePoseBatch(Connection& connection, const PoseBatch& batch, const PoseBatchResult& result) {
  RowHash hash(RowKind::kPoseBatch);
  hash.Unsigned(result.batch).Unsigned(result.revision).Text(batch.author);
  hash.Unsigned(result.updated).Unsigned(batch.if_revision);
  connection
      .Prepare(
          "INSERT INTO pose_batches (id, revision, author, updated, if_revision, checksum) "
          "VALUES (?,?,?,?,?,?)")
      .Bind(result.batch)
      .Bind(result.revision)
      .Bind(std::string_view(batch.author))
      .Bind(result.updated)
      .Bind(batch.if_revision)
      .Bind(hash.value())
      .Run();
}

}  // namespace atlas
