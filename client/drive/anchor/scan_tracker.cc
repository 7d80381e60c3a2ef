#include "client/drive/anchor/scan_tracker.h"

#include <algorithm>

namespace atlas {

Result<LocalizationResult> ScanTracker::Track(const LeveledScan& scan,
                                              const Eigen::Quaterniond& R_level_sensor,
                                              const Pose& T_map_expected,
                                              double step_m) {
  constexpr StartHint kExpected{0.5, 0.05};
  const bool is_begun = lost_ == kGivenUp;
  if (is_begun) localizer_.Start(T_map_expected, kExpected);
  // A metre is a scan to the localizer, so that each vehicle is as fast.
  auto located = localizer_.Localize(scan, R_level_sensor, step_m);
  if (!located) return located;
  const bool is_lost = located->health == LocalizationHealth::kLost;
  // Whoever was not found yet does not know how fast he is, and cannot be looked for further on.
  lost_ = !is_lost ? 0 : is_begun ? kGivenUp : std::min(lost_ + 1, kGivenUp);
  return located;
}

}  // namespace atlas
