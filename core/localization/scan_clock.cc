#include "core/localization/scan_clock.h"

#include <algorithm>

namespace atlas {

double ScanClock::Tick(std::optional<double> time_s) {
  const bool goes_on = time_s && last_s_ && *time_s > *last_s_;
  const double since_s = goes_on ? *time_s - *last_s_ : 0.0;
  if (time_s) last_s_ = time_s;
  if (!goes_on) return 1.0;
  if (!interval_s_) interval_s_ = since_s;
  return std::min(since_s / *interval_s_, kMost);
}

void ScanClock::Restart() {
  last_s_.reset();
  interval_s_.reset();
}

}  // namespace atlas
