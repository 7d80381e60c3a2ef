// How many sessions each vehicle began lately: an hour's worth may begin at once, and then as many
// an hour. Sessions stay for good, and everybody who asks for them is told of all: a vehicle that
// runs wild must not make them by the thousand. Kept in memory: no vehicle restarts the daemon.
// Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "core/base/status.h"

namespace atlas {

class SessionStarts {
 public:
  using Clock = std::chrono::steady_clock;

  // 0: no limit.
  explicit SessionStarts(std::uint32_t per_hour) : per_hour_(per_hour) {}

  // From now on; what was begun stays counted.
  void set_per_hour(std::uint32_t per_hour) {
    const std::lock_guard lock(mutex_);
    per_hour_ = per_hour;
  }
  // It begins one. kUnavailable: not yet.
  Status Begin(const std::string& vehicle, Clock::time_point now);
  // Whose sessions are counted.
  std::size_t vehicles() const {
    const std::lock_guard lock(mutex_);
    return rested_at_.size();
  }

  // Beyond it the count begins anew: only who may upload for any vehicle gets there.
  static constexpr std::size_t kMaxVehicles = 65'536;

 private:
  void ForgetRested(Clock::time_point now);

  mutable std::mutex mutex_;
  std::uint32_t per_hour_;
  std::map<std::string, Clock::time_point> rested_at_;  // when nothing counts any more, by vehicle
};

}  // namespace atlas
