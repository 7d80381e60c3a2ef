// Where scans were localized, as text that other programs read.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "client/drive/drive_localization.h"
#include "core/base/status.h"

namespace atlas {

enum class TrackFormat {
  kCsv,  // a line a scan with errors, health and sigmas; the first line names the columns
  // "time x y z qx qy qz qw", T_world_sensor; scans' numbers where there is no time. None of a scan
  // that is lost.
  kTum,
  // 12 numbers, 3x4 row-major, T_world_sensor, as poses.txt: a line a scan, also of one that is
  // lost, where it thought it was.
  kKitti,
};

// By the name's ending, .csv, .tum or .kitti in letters of either case; else kInvalidArgument.
Result<TrackFormat> TrackFormatOf(const std::filesystem::path& path);

// Metres and seconds; angles of the CSV in degrees. Its errors are estimate less truth, along the
// true heading, across it (left is positive) and upwards; sigmas and NEES are empty where the
// method claims none.
std::string TrackText(TrackFormat format, std::span<const LocalizedScan> scans);

}  // namespace atlas
