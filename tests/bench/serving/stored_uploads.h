// The keyframes of an atlas whose daemon has ended, to be uploaded again under other names: made
// before, so that no front end runs beside what is measured.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/pose.h"

namespace atlas::testing {

struct StoredUpload {
  std::int64_t time_ms = 0;
  QuantizedPose T_world_sensor;
  Bytes blob;
  std::int64_t session = 0;  // which of them it was in
};

// In the order in which they came. Reads the database by its tables (docs/formats/store.md):
// the library of the daemon has no place beside that of its clients. kInvalidData: none.
Result<std::vector<StoredUpload>> ReadStoredUploads(const std::filesystem::path& database);

}  // namespace atlas::testing
