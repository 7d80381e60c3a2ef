// Whether a peer takes what waits for it: at least so many bytes in each window of time, as long as
// something waits. Pure: the time is passed in.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "server/net/net_options.h"

namespace atlas {

class WritePace {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit WritePace(const NetOptions& options) : options_(options) {}

  // Something waits from now on. `taken_bytes`: by the peer, since ever.
  void Begin(Time now, std::int64_t taken_bytes) { window_ = {now, taken_bytes}; }
  // Nothing waits.
  void End() { window_.reset(); }
  bool is_running() const { return window_.has_value(); }
  // The window is over: what was taken in it is to be judged.
  bool IsDue(Time now) const { return window_ && now - window_->begin > options_.write_stall; }
  // In the one that is over; the next one begins.
  bool WasTooSlow(Time now, std::int64_t taken_bytes) {
    const std::chrono::duration<double> passed = now - window_->begin;
    const auto taken = static_cast<double>(taken_bytes - window_->taken_bytes);
    Begin(now, taken_bytes);
    return taken < passed.count() * static_cast<double>(options_.min_write_bytes_per_s);
  }

 private:
  struct Window {
    Time begin;
    std::int64_t taken_bytes = 0;
  };

  const NetOptions& options_;
  std::optional<Window> window_;
};

}  // namespace atlas
