// Where a drive's scans lead one after the other, whatever its poses say: a part of it that was
// moved to the next deck, or along a row of pillars, fits there scan by scan, but none of them
// leads there.
#pragma once

#include <cstddef>
#include <utility>

#include "core/base/status.h"
#include "core/geometry/pose.h"
#include "core/localization/localizer.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

class ScanTracker {
 public:
  ScanTracker(const MapProfile& profile, TilesAround tiles, const LocalizerOptions& options)
      : localizer_(profile, std::move(tiles), options) {}

  // The next scan is where it is expected, as one is behind several that were lost.
  void Begin() { lost_ = kGivenUp; }
  // `step_m` behind the last one. Errors are those of the tiles' source.
  Result<LocalizationResult> Track(const LeveledScan& scan,
                                   const Eigen::Quaterniond& R_level_sensor,
                                   const Pose& T_map_expected,
                                   double step_m);

 private:
  static constexpr std::size_t kGivenUp = 3;  // scans lost in a row

  Localizer localizer_;
  std::size_t lost_ = kGivenUp;
};

}  // namespace atlas
