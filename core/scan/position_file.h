// Positions of a drive's scans that are known from elsewhere (GNSS): a line "SCAN X Y Z RADIUS" for
// each scan of which there is one, in any order. Blank lines and lines that start with # are
// skipped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/scan/drive_folder.h"

namespace atlas {

// Where the sensor was, in metres.
struct KnownPlace {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double radius_m = 0.0;  // one standard deviation along each axis, from 0.001 to 100,000

  friend bool operator==(const KnownPlace&, const KnownPlace&) = default;
};

using KnownPlaces = std::map<std::uint32_t, KnownPlace>;  // by the scan's number

// kInvalidData names the line: not five numbers, a number that no scan of the drive has or that
// another line had, a coordinate that is not finite or beyond 10,000 km, a radius out of range; or
// says that there is no position in it. Else as ReadLines.
Result<KnownPlaces> ReadPositions(const std::filesystem::path& path, const DriveFolder& drive);

// A file that reads back as these, to a tenth of a millimetre.
std::string PositionFileText(const KnownPlaces& places);

}  // namespace atlas
