// A recorded drive on disk: velodyne/NNNNNN.bin, poses.txt, optional times.txt and labels/.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/pose.h"

namespace atlas {

struct DriveScan {
  std::uint32_t number = 0;  // from the file name
  std::filesystem::path scan;
  std::optional<std::filesystem::path> label;
  Pose T_world_sensor = Pose::Identity();
  std::optional<double> time_s;
};

struct DriveFolder {
  std::filesystem::path path;
  std::vector<DriveScan> scans;  // by number
};

// Line `number` (from 0) of poses.txt and times.txt belongs to scan NNNNNN. kNotFound without the
// folder, velodyne/ or poses.txt; kPermissionDenied; kInvalidData for a bad line, more scans than
// lines, no scan, or two of one number. The scans themselves are not opened.
Result<DriveFolder> OpenDriveFolder(const std::filesystem::path& path);

// Lines of 12 numbers (3x4 row-major); errors name the line.
Result<std::vector<Pose>> ReadPoses(const std::filesystem::path& path);

}  // namespace atlas
