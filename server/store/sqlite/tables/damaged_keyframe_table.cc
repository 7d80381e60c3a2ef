#include "server/store/sqlite/tables/damaged_keyframe_table.h"

#include <cstdint>
#include <string_view>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

std::int64_t HashOf(const DamagedKeyframe& row) {
  return RowHash(RowKind::kDamagedKeyframe)
      .Int(row.id)
      .Unsigned(row.revision)
      .Int(row.time_ms)
      .Text(row.reason)
      .value();
}

// Columns: keyframe_id, revision, time_ms, reason, checksum.
Result<DamagedKeyframe> ReadRow(Query& row) {
  row.Rewind();
  DamagedKeyframe keyframe;
  keyframe.id = row.Int();
  keyframe.revision = row.Unsigned();
  keyframe.time_ms = row.Int();
  keyframe.reason = row.Text();
  if (!row.IsChecksum(HashOf(keyframe))) {
    return Error(StatusCode::kInvalidData, StrCat("store: what is noted of the damaged keyframe ",
                                                  keyframe.id, " is damaged: wrong checksum"));
  }
  return keyframe;
}

}  // namespace

bool IsListedAsDamaged(Connection& connection, std::int64_t keyframe_id) {
  Query row = connection.Prepare(
      "SELECT keyframe_id, revision, time_ms, reason, checksum FROM damaged_keyframes "
      "WHERE keyframe_id = ?");
  row.Bind(keyframe_id);
  return row.Step() && ReadRow(row).has_value();
}

Result<std::vector<DamagedKeyframe>> ReadDamagedKeyframes(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT keyframe_id, revision, time_ms, reason, checksum FROM damaged_keyframes "
      "ORDER BY keyframe_id");
  std::vector<DamagedKeyframe> keyframes;
  while (row.Step()) {
    auto keyframe = ReadRow(row);
    if (!keyframe) {
      return Error(keyframe.error());
    }
    keyframes.push_back(*std::move(keyframe));
  }
  return keyframes;
}

void WriteDamagedKeyframe(Connection& connection, const DamagedKeyframe& keyframe) {
  connection
      .Prepare(
          "INSERT OR REPLACE INTO damaged_keyframes "
          "(keyframe_id, revision, time_ms, reason, checksum) VALUES (?,?,?,?,?)")
      .Bind(keyframe.id)
      .Bind(keyframe.revision)
      .Bind(keyframe.time_ms)
      .Bind(std::string_view(keyframe.reason))
      .Bind(HashOf(keyframe))
      .Run();
}

Status CheckDamagedKeyframes(Connection& connection) {
  const auto keyframes = ReadDamagedKeyframes(connection);
  return keyframes ? Status() : keyframes.error();
}

int ForgetUnknownDamage(Connection& connection) {
  std::vector<std::int64_t> unknown;
  {
    Query row = connection.Prepare(
        "SELECT keyframe_id, revision, time_ms, reason, checksum FROM damaged_keyframes");
    while (row.Step()) {
      if (!ReadRow(row)) {
        row.Rewind();
        unknown.push_back(row.Int());
      }
    }
  }
  for (const std::int64_t id : unknown) {
    DeleteDamagedKeyframe(connection, id);
  }
  return static_cast<int>(unknown.size());
}

bool DeleteDamagedKeyframe(Connection& connection, std::int64_t keyframe_id) {
  return connection.Prepare("DELETE FROM damaged_keyframes WHERE keyframe_id = ?")
             .Bind(keyframe_id)
             .Run() > 0;
}

}  // namespace atlas
