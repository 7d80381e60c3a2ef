// Writes a simulated drive as a folder of scans: velodyne/NNNNNN.bin, labels/NNNNNN.label,
// poses.txt, times.txt and boxes.txt (docs/simulation.md). The folder appears whole or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "core/base/status.h"
#include "core/simulation/simulated_drive.h"

namespace atlas {

using DriveProgress = std::function<Status(std::size_t scans_written)>;

// Scans are written one at a time into a new folder beside it (`folder`.partial, or .partialN where
// others have that), which is renamed at the end and removed on failure; `progress` (may be empty)
// is called after each and before the end, and ends it by an error of its own. kConflict when
// `folder` exists and is not empty; kInvalidData when a scan would be empty; kPermissionDenied,
// kNotFound or kResourceExhausted (full disk) as the system says.
Status WriteDrive(const SimulatedDrive& drive,
                  const std::filesystem::path& folder,
                  const DriveProgress& progress);

}  // namespace atlas
