#include "client/drive/drive_times.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/localization/scan_clock.h"

namespace atlas {
namespace {

// Which of `times` go on. Of two that do not, one is left out if its neighbours go on without it:
// the one whose neighbours are then further apart. Else the clock was set back, and both are right.
std::vector<bool> GoOn(const std::vector<double>& times) {
  std::vector<bool> goes_on(times.size(), true);
  std::vector<double> run;  // since the clock was set
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (run.empty() || times[i] > run.back()) {
      run.push_back(times[i]);
      continue;
    }
    const bool is_last = i + 1 == times.size();
    const double without_this = is_last ? 0.0 : times[i + 1] - run.back();
    const double without_that = run.size() < 2 ? 0.0 : times[i] - run[run.size() - 2];
    if ((is_last || without_this > 0.0) && without_this >= without_that) {
      goes_on[i] = false;
    } else if (run.size() < 2 || without_that > 0.0) {
      std::size_t that = i - 1;
      while (!goes_on[that]) --that;
      goes_on[that] = false;
      run.back() = times[i];
    } else {
      run.assign(1, times[i]);
    }
  }
  return goes_on;
}

// How far the second of three is from the first one to the third, by their numbers.
double NumberShare(const DriveFolder& drive,
                   const std::vector<SelectedScan>& selected,
                   const std::array<std::size_t, 3>& scans) {
  const auto number = [&](std::size_t i) {
    return static_cast<double>(drive.scans[selected[scans.at(i)].index].number);
  };
  return (number(1) - number(0)) / (number(2) - number(0));
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
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < told.size(); ++i) {
    if (!goes_on[i]) continue;
    times[i] = told[i];
    if (before && told[i] > told[*before]) {
      for (std::size_t j = *before + 1; j < i; ++j) {
        const double share = NumberShare(drive, selected, {*before, j, i});
        times[j] = told[*before] + share * (told[i] - told[*before]);
      }
    }
    before = i;
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
