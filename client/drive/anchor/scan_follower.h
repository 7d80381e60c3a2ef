// Scans of a drive, each located in the map near where the ones before it and the drive's own
// motion have it.
#pragma once

#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "client/drive/anchor/frame_fit.h"
#include "client/drive/anchor/scan_source.h"
#include "client/drive/anchor/scan_tracker.h"
#include "client/drive/drive_survey.h"
#include "client/map/map_view.h"
#include "core/base/status.h"
#include "core/localization/localizer.h"
#include "core/scan/drive_folder.h"

namespace atlas {

// Of one part, in their order, not empty.
using PartScans = std::span<const DriveScan* const>;

// How far each scan is along the drive, in metres.
std::vector<double> WaysOf(PartScans scans);
// Up to `count` of them, evenly spread along the way, at least `spacing_m` apart.
std::vector<std::size_t> SpreadAlong(const std::vector<double>& way_m,
                                     std::size_t count,
                                     double spacing_m);

struct FollowOptions {
  double spacing_m = 1.0;  // of the scans, at least
  // A scan that is farther from where it is expected is found elsewhere; of the way since the last
  // one that was found `drift` is added.
  double max_surprise_m = 0.5;
  double max_surprise_rad = 2.0 * std::numbers::pi / 180.0;
  double drift = 0.01;
};

class ScanFollower {
 public:
  // `view` outlives it.
  ScanFollower(const DriveSurvey& survey,
               const ScanSource& source,
               MapView& view,
               const FollowOptions& options);

  // From `seed` to the end and to the beginning, where `T_map_drive` puts the first ones and the
  // last ones that were found put the next. `is_led`: astray are those, too, that fit there, but to
  // which the scans before them do not lead. In the drive's order; left out are those whose place
  // is not mapped, as far as that is known, and those that are weak where they are expected, on the
  // ground. Errors are those of the scans and of the view.
  Result<std::vector<FollowedScan>> Follow(PartScans scans,
                                           std::size_t seed,
                                           const LevelTransform& T_map_drive,
                                           bool is_led);

 private:
  struct Expected {
    Pose T_map_sensor;
    double slack_m = 0.0;          // that it may be farther off
    std::optional<double> step_m;  // from the last scan, if these lead to it
  };
  struct Looked {
    bool is_found = false;
    bool is_astray = false;
    Pose T_map_sensor = Pose::Identity();
    double fit = 0.0;
  };

  Status Follow(PartScans scans,
                const std::vector<double>& way_m,
                const std::vector<std::size_t>& order,
                const LevelTransform& T_map_drive,
                bool is_led,
                std::vector<FollowedScan>& followed);
  Result<Looked> LookAt(const DriveScan& scan, const Expected& expected);
  Result<bool> IsOffGround(const Pose& T_map_sensor) const;
  Result<bool> IsMapped(const Expected& expected) const;
  bool IsNear(const Pose& found, const Expected& expected) const;

  FollowOptions options_;
  double mount_m_;  // of the sensor, above the ground
  ScanSource source_;
  MapView* view_;
  Localizer localizer_;
  ScanTracker tracker_;
};

}  // namespace atlas
