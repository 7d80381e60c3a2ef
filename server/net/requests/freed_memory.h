// Memory that requests leave free between blocks that stay: when that is much it goes back to the
// system, but not often, since all threads wait meanwhile. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>

namespace atlas {

class FreedMemory {
 public:
  using Clock = std::chrono::steady_clock;

  struct Options {
    std::size_t min_bytes = 16u << 20;
    Clock::duration pause = std::chrono::seconds(10);  // from one time to the next
  };

  FreedMemory() : FreedMemory(Options()) {}
  explicit FreedMemory(const Options& options) : options_(options) {}

  void Note(std::size_t bytes) { bytes_.fetch_add(bytes); }
  // It is to be returned, by whoever is told so. To be asked now and then.
  bool IsDue(Clock::time_point now) {
    if (bytes_.load() < options_.min_bytes) {
      return false;
    }
    auto not_before = not_before_.load();
    const auto next = (now + options_.pause).time_since_epoch().count();
    if (now.time_since_epoch().count() < not_before ||
        !not_before_.compare_exchange_strong(not_before, next)) {
      return false;
    }
    bytes_.store(0);
    return true;
  }

 private:
  const Options options_;
  std::atomic<std::size_t> bytes_ = 0;  // since the last time
  std::atomic<Clock::rep> not_before_ = Clock::time_point::min().time_since_epoch().count();
};

}  // namespace atlas
