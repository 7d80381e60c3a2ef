#include "tests/bench/serving/stored_uploads.h"

#include <cstddef>

#include <SQLiteCpp/SQLiteCpp.h>

#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

constexpr const char* kSelect =
    "SELECT time_ms, x_um, y_um, z_um, qw, qx, qy, qz, blob, session_id FROM keyframes "
    "JOIN poses ON keyframe_id = id ORDER BY id";

StoredUpload UploadOf(SQLite::Statement& row) {
  StoredUpload upload;
  upload.time_ms = row.getColumn(0).getInt64();
  upload.T_world_sensor.x_um = row.getColumn(1).getInt64();
  upload.T_world_sensor.y_um = row.getColumn(2).getInt64();
  upload.T_world_sensor.z_um = row.getColumn(3).getInt64();
  for (int i = 0; i < 4; ++i) {
    upload.T_world_sensor.quaternion[static_cast<std::size_t>(i)] = row.getColumn(4 + i).getInt();
  }
  const SQLite::Column blob = row.getColumn(8);
  const auto* const data = static_cast<const std::uint8_t*>(blob.getBlob());
  upload.blob.assign(data, data + blob.getBytes());
  upload.session = row.getColumn(9).getInt64();
  return upload;
}

}  // namespace

Result<std::vector<StoredUpload>> ReadStoredUploads(const std::filesystem::path& database) {
  try {
    SQLite::Database file(database.string(), SQLite::OPEN_READONLY);
    SQLite::Statement row(file, kSelect);
    std::vector<StoredUpload> uploads;
    while (row.executeStep()) {
      uploads.push_back(UploadOf(row));
    }
    if (uploads.empty()) {
      return Error(StatusCode::kInvalidData, StrCat(database.string(), ": no keyframes"));
    }
    return uploads;
  } catch (const SQLite::Exception& error) {
    return Error(StatusCode::kInvalidData, StrCat(database.string(), ": ", error.what()));
  }
}

}  // namespace atlas::testing
