// How long things took: counts by duration, kept by one thread and read by any.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "server/base/thread_counter.h"

namespace atlas {

// Upper ends of the classes; the last class has none. From a reply out of memory to a long wait.
inline constexpr std::array<double, 16> kDurationBounds_s = {
    0.00025, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
    0.1,     0.25,   0.5,   1.0,    2.5,   5.0,  10.0,  60.0};

struct DurationFigures {
  std::array<std::uint64_t, kDurationBounds_s.size() + 1> counts{};  // by class
  double sum_s = 0.0;

  std::uint64_t count() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t count : counts) {
      sum += count;
    }
    return sum;
  }
};

class DurationHistogram {
 public:
  // By the one thread.
  void Add(std::chrono::nanoseconds duration) {
    const double duration_s = std::chrono::duration<double>(duration).count();
    const auto* const end =
        std::find_if(kDurationBounds_s.begin(), kDurationBounds_s.end(),
                     [duration_s](double bound_s) { return duration_s <= bound_s; });
    counts_[static_cast<std::size_t>(end - kDurationBounds_s.begin())].Add();
    sum_ns_.Add(static_cast<std::uint64_t>(duration.count()));
  }

  void AddTo(DurationFigures& figures) const {
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      figures.counts[i] += counts_[i].value();
    }
    figures.sum_s += 1e-9 * static_cast<double>(sum_ns_.value());
  }

 private:
  std::array<ThreadCounter, kDurationBounds_s.size() + 1> counts_;
  ThreadCounter sum_ns_;
};

}  // namespace atlas
