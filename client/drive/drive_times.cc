#include "client/drive/drive_times.h"

#include <algorithm>
#include <cstddef>

#include "core/localization/scan_clock.h"

namespace atlas {
namespace {

// The longest increasing subsequence (patience sorting): which of `times` are in it.
std::vector<bool> GoOn(const std::vector<double>& times) {
  std::vector<std::size_t> last;  // by length: the last of the one that ends earliest
  std::vector<std::size_t> before(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto place =
        std::lower_bound(last.begin(), last.end(), times[i],
                         [&](std::size_t other, double time) { return times[other] < time; });
    before[i] = place == last.begin() ? i : *(place - 1);
    if (place == last.end()) {
      last.push_back(i);
    } else {
      *place = i;
    }
  }
  std::vector<bool> goes_on(times.size(), false);
  if (last.empty()) return goes_on;
  std::size_t i = last.back();
  for (; before[i] != i; i = before[i]) goes_on[i] = true;
  goes_on[i] = true;
  return goes_on;
}

}  // namespace

bool IsTimed(const DriveFolder& drive, const std::vector<SelectedScan>& selected) {
  return std::all_of(selected.begin(), selected.end(), [&](const SelectedScan& scan) {
    return drive.scans[scan.index].time_s.has_value();
  });
}

std::vector<std::optional<double>> TimesOf(const DriveFolder& drive,
                                           const std::vector<SelectedScan>& selected) {
  const bool is_timed = IsTimed(drive, selected);
  std::vector<double> told;
  told.reserve(selected.size());
  for (const SelectedScan& scan : selected) {
    const DriveScan& made = drive.scans[scan.index];
    told.push_back(is_timed ? *made.time_s : static_cast<double>(made.number));
  }
  const std::vector<bool> goes_on = GoOn(told);
  std::vector<std::optional<double>> times(told.size());
  for (std::size_t i = 0; i < told.size(); ++i) {
    if (goes_on[i]) times[i] = told[i];
  }
  return times;
}

std::optional<double> UsualIntervalOf(const std::vector<std::optional<double>>& times) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] && times[i - 1]) intervals.push_back(*times[i] - *times[i - 1]);
  }
  return intervals.empty() ? std::nullopt : std::optional(UsualInterval_s(intervals));
}

}  // namespace atlas
