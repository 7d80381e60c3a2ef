// A recorded drive localized in an atlas: by single shots from disturbed starts, or tracked from
// its first pose. The drive's poses go to the scorer; the localizer is told what an IMU and the
// start say, and nothing else.
#pragma once

#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "client/drive/drive_monitor.h"
#include "client/drive/drive_selection.h"
#include "client/drive/drive_skew.h"
#include "client/drive/scan_localizer.h"
#include "client/drive/unreadable_scan.h"
#include "client/map/map_view.h"
#include "client/score/localization_score.h"
#include "client/score/pose_offset.h"
#include "core/base/status.h"
#include "core/localization/localizer.h"
#include "core/scan/drive_folder.h"

namespace atlas {

enum class LocalizationMode { kAtlas, kPaper };  // ours; the paper's encode, decode and ICP

// Where tracking starts is told, off by up to this, and believed (core/localization/localizer.h).
struct ToldStart {
  double radius_m = 1.5;
  double height_m = 1.5;
};

struct DriveLocalizationOptions {
  struct Shots {
    double translation_m = 0.0;  // x and y of the start, uniform +-
    double yaw_rad = 0.0;
    std::uint32_t trials = 10;  // a scan
  };

  LocalizationMode mode = LocalizationMode::kAtlas;
  SelectionOptions selection;
  std::optional<std::uint32_t> rings;
  std::optional<double> max_range_m;  // 100 m; the paper's: 40 m
  DeskewOptions deskew;               // by the predicted motion: not for single shots
  std::optional<Shots> shots;         // tracking, if not given
  std::uint64_t seed = 0;
  bool is_restarted = true;        // tracking is told where it is after a jump
  std::optional<ToldStart> start;  // else it is told without an error, and has it for a hint
  // Tracking in mode kAtlas: is shown each scan that is not lost, and outlives the run; may be
  // null.
  DriveMonitor* monitor = nullptr;
  double tilt_error_rad = 0.5 * std::numbers::pi / 180.0;  // a cheap IMU's

  double range_m() const {
    return max_range_m.value_or(mode == LocalizationMode::kPaper ? 40.0 : 100.0);
  }
  // kInvalidArgument naming the first option out of range.
  Status Validate() const;
};

struct LocalizedScan {
  std::uint32_t scan = 0;
  std::uint32_t trial = 0;
  std::optional<double> time_s;  // where the drive says it
  LocatedScan located;
  PoseError error;
  PoseOffset offset;
  // Of (along, left, up, yaw), where the method knows it, and the error measured against it.
  std::optional<Eigen::Matrix4d> covariance;
  std::optional<double> normalized_square;
  bool is_failure = false;     // as LocalizationScore counts
  bool is_after_jump = false;  // tracking began again here
  double cpu_s = 0.0;
};

struct DriveLocalizationReport {
  LocalizationScore score;
  std::uint64_t scans = 0;
  // What the localizer said of its shots, and how often it said good where it was a failure.
  std::uint64_t good = 0;
  std::uint64_t weak = 0;
  std::uint64_t good_failures = 0;
  UnreadableScans unreadable;         // while tracking: lost there, and it goes on
  std::uint64_t restarts = 0;         // after jumps
  std::uint64_t dropped_returns = 0;  // entries without one (scan_reader.h)
  double cpu_s = 0.0;                 // segmentation and tiles included
  DeskewDecision deskewing;

  // Shots a CPU second.
  double hz() const { return cpu_s > 0.0 ? static_cast<double>(score.shots()) / cpu_s : 0.0; }
};

// `on_scan` is told of each scan, of those that are unreadable, too. Errors are those of the
// options, of the map and of files: a damaged scan ends single shots, and what comes before
// tracking.
Result<DriveLocalizationReport> LocalizeDrive(
    const DriveFolder& drive,
    const DriveLocalizationOptions& options,
    MapView& view,
    const std::function<void(const LocalizedScan&)>& on_scan);
// By a method of the caller's; `options.mode` and the range mean nothing then.
Result<DriveLocalizationReport> LocalizeDrive(
    const DriveFolder& drive,
    const DriveLocalizationOptions& options,
    ScanLocalizer& localizer,
    const std::function<void(const LocalizedScan&)>& on_scan);

}  // namespace atlas
