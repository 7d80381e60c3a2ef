// How much of the usual time between two scans has passed since the last one: a sensor turns
// evenly, but not all of its scans arrive.
#pragma once

#include <optional>

namespace atlas {

class ScanClock {
 public:
  // `time_s` of the scan at hand; none: nobody knows. Times the first interval after Restart(); 1
  // where that is not known, and where time does not go on, of the scan behind it, too: its time
  // may have been the wrong one.
  double Tick(std::optional<double> time_s);
  // The next scan has nothing to do with those before.
  void Restart();

 private:
  static constexpr double kMost = 100.0;  // later nothing is left of what was known

  std::optional<double> last_s_;
  std::optional<double> interval_s_;
};

}  // namespace atlas
