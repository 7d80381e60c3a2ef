// A recorded drive's scans found in an atlas, each alone, with no idea of where it was taken or
// near a position such as GNSS gives, or a height such as a barometer gives. The drive's poses go
// to the scorer, and disturbed into these.
#pragma once

#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>

#include "client/drive/drive_selection.h"
#include "client/drive/unreadable_scan.h"
#include "client/map/map_view.h"
#include "client/score/localization_score.h"
#include "client/score/pose_offset.h"
#include "core/base/status.h"
#include "core/localization/relocalizer.h"
#include "core/scan/drive_folder.h"

namespace atlas {

struct DriveRelocalizationOptions {
  SelectionOptions selection;
  std::optional<std::uint32_t> rings;
  double max_range_m = 40.0;
  std::optional<double> prior_radius_m;  // the position is given, off by up to this,
  std::optional<double> prior_height_m;  // and the height, by up to this
  std::uint64_t seed = 0;                // of how far it is off, and of the IMU's error
  double tilt_error_rad = 0.5 * std::numbers::pi / 180.0;

  // kInvalidArgument naming the first option out of range.
  Status Validate() const;
};

struct RelocalizedScan {
  std::uint32_t scan = 0;
  std::optional<double> time_s;  // where the drive says it
  Relocalization found;
  // Of what was found, or would have been; nothing where there is no place at all.
  PoseError error;
  PoseOffset offset;
};

struct DriveRelocalizationReport {
  std::uint64_t scans = 0;
  std::uint64_t right = 0;            // found within kRight_m
  std::uint64_t wrong = 0;            // found elsewhere
  std::uint64_t unknown = 0;          // "don't know"
  std::size_t places = 0;             // of the map
  UnreadableScans unreadable;         // of those unknown: damaged
  std::uint64_t dropped_returns = 0;  // entries without one (scan_reader.h)
  double cpu_s = 0.0;                 // of all scans, segmentation and tiles included
  double worst_cpu_s = 0.0;           // of one
  LocalizationScore score;            // of those found

  static constexpr double kRight_m = 0.5;
};

// Reads the whole map first. `on_scan` is told of each scan, of those that are unreadable, too.
Result<DriveRelocalizationReport> RelocalizeDrive(
    const DriveFolder& drive,
    const DriveRelocalizationOptions& options,
    MapView& view,
    const std::function<void(const RelocalizedScan&)>& on_scan);

}  // namespace atlas
