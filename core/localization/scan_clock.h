// How much of the usual time between two scans has passed since the last one: a sensor turns
// evenly, but not all of its scans arrive.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace atlas {

// Of intervals between scans, in seconds, the usual one: many may be too long, for scans are
// missing, and some too short, for times are wrong. Those about as long as the lower quartile are
// usual, their mean is it. Changes their order; requires one that is longer than 0.
double UsualInterval_s(std::span<double> intervals_s);

class ScanClock {
 public:
  // `usual_s`: a revolution of the sensor, if it is known; else learnt of the last intervals, so
  // that what is missing among the first scans makes two or three of them look like others.
  explicit ScanClock(std::optional<double> usual_s = std::nullopt) : usual_s_(usual_s) {}

  // `time_s` of the scan at hand; none: nobody knows. Times the usual interval; 1 where that or the
  // time is not known, as is counted at the next one that is; and where time does not go on, of the
  // scan behind it, too: its time may have been the wrong one.
  double Tick(std::optional<double> time_s);
  // The next scan has nothing to do with those before, but is the same sensor's.
  void Restart() {
    last_s_.reset();
    unknown_ = 0.0;
  }

 private:
  static constexpr double kLeast = 0.1;   // who has scans in between had time for them
  static constexpr double kMost = 100.0;  // later nothing is left of what was known
  static constexpr std::size_t kKept = 64;

  double Usual_s() const;

  std::optional<double> usual_s_;
  std::optional<double> last_s_;
  double unknown_ = 0.0;  // scans since then
  std::array<double, kKept> intervals_s_{};
  std::size_t intervals_ = 0;  // so far: the last kKept of them are kept
};

}  // namespace atlas
