// Writes a simulated drive as a folder of scans: velodyne/NNNNNN.bin, labels/NNNNNN.label,
// poses.txt, times.txt and boxes.txt (docs/simulation.md), truth.txt where poses.txt has an
// odometry's drift, and positions.txt where a GNSS is asked for. The folder appears whole or not at
// all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>

#include "core/base/status.h"
#include "core/simulation/gnss_noise.h"
#include "core/simulation/pose_drift.h"
#include "core/simulation/simulated_drive.h"

namespace atlas {

using DriveProgress = std::function<Status(std::size_t scans_written)>;

struct DriveWriteOptions {
  // Scans [begin, end) of the drive are written, as 0, 1, ...
  std::size_t begin = 0;
  std::size_t end = SIZE_MAX;
  std::optional<DriftOptions> drift;  // of poses.txt, from the first scan written on
  std::optional<GnssOptions> gnss;    // that positions.txt is of

  // kInvalidArgument naming the first option out of range.
  Status Validate(const SimulatedDrive& drive) const;
};

// Scans are written one at a time into a new folder beside it (`folder`.partial, or .partialN where
// others have that), which is renamed at the end and removed on failure; `progress` (may be empty)
// is called after each and before the end, and ends it by an error of its own. kConflict when
// `folder` exists and is not empty; kInvalidArgument as its options say; kInvalidData when a scan
// would be empty; kPermissionDenied, kNotFound or kResourceExhausted (full disk) as the system
// says.
Status WriteDrive(const SimulatedDrive& drive,
                  const std::filesystem::path& folder,
                  const DriveProgress& progress,
                  const DriveWriteOptions& options = {});

}  // namespace atlas
