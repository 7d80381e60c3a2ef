#include "core/localization/scan_clock.h"

#include <algorithm>
#include <utility>

namespace atlas {

double ScanClock::Tick(std::optional<double> time_s) {
  if (!time_s) return 1.0;
  const std::optional<double> before_s = std::exchange(last_s_, time_s);
  if (!before_s) return 1.0;
  if (*time_s <= *before_s) {
    last_s_.reset();  // one of both is wrong, nobody knows which
    return 1.0;
  }
  const double since_s = *time_s - *before_s;
  if (!interval_s_) interval_s_ = since_s;
  return std::min(since_s / *interval_s_, kMost);
}

void ScanClock::Restart() {
  last_s_.reset();
  interval_s_.reset();
}

}  // namespace atlas
