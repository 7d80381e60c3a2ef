#include "core/localization/scan_clock.h"

#include <algorithm>
#include <utility>

namespace atlas {

double UsualInterval_s(std::span<double> intervals_s) {
  constexpr double kShortest = 0.5;
  constexpr double kLongest = 1.5;  // two of them are one that is missing
  const auto quartile = intervals_s.begin() + static_cast<std::ptrdiff_t>(intervals_s.size() / 4);
  std::nth_element(intervals_s.begin(), quartile, intervals_s.end());
  const double about_s = *quartile;
  double sum_s = 0.0;
  int usual = 0;
  for (const double interval_s : intervals_s) {
    if (interval_s > kShortest * about_s && interval_s < kLongest * about_s) {
      sum_s += interval_s;
      ++usual;
    }
  }
  return sum_s / usual;
}

double ScanClock::Tick(std::optional<double> time_s) {
  if (!time_s) {
    unknown_ += 1.0;
    return 1.0;
  }
  const std::optional<double> before_s = std::exchange(last_s_, time_s);
  const double unknown = std::exchange(unknown_, 0.0);
  if (!before_s) return 1.0;
  if (*time_s <= *before_s) {
    last_s_.reset();  // one of both is wrong, nobody knows which
    return 1.0;
  }
  const double since_s = *time_s - *before_s;
  if (unknown == 0.0) intervals_s_[intervals_++ % kKept] = since_s;
  const double since = intervals_ > 0 || usual_s_ ? since_s / Usual_s() - unknown : 1.0;
  return std::clamp(since, kLeast, kMost);
}

double ScanClock::Usual_s() const {
  if (usual_s_) return *usual_s_;
  auto intervals_s = intervals_s_;
  return UsualInterval_s(std::span(intervals_s).first(std::min(intervals_, kKept)));
}

}  // namespace atlas
