// Simulated drives as what their vehicles upload.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/simulation/simulated_drive.h"
#include "server/service/upload_check.h"

namespace atlas::testing {

struct UploadOptions {
  std::string vehicle = "car";
  std::string session = "drive";  // a jump begins `session`.2
  std::int64_t start_ms = 0;
  double range_m = 20.0;
  std::size_t begin = 0;  // half-open range of scans
  std::size_t end = SIZE_MAX;
};

Result<std::vector<UploadRequest>> MakeUploads(const SimulatedDrive& drive,
                                               const MapProfile& profile,
                                               const UploadOptions& options);

}  // namespace atlas::testing
