// How fast one name is sent replies, on all its connections together: a second's worth at once, and
// then as fast as it may. Thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <mutex>

#include "server/net/connection/token_bucket.h"

namespace atlas {

class ServedRate {
 public:
  using Time = TokenBucket::Time;
  using Duration = TokenBucket::Duration;

  // 0: no limit.
  explicit ServedRate(double bytes_per_s) : bytes_per_s_(bytes_per_s), bytes_(bytes_per_s) {}

  // That is sent, or set aside for what is being made.
  void Charge(std::size_t bytes, Time now) { Take(static_cast<double>(bytes), now); }
  void Refund(std::size_t bytes, Time now) { Take(-static_cast<double>(bytes), now); }
  // Until nothing is owed any more.
  Duration Pause(Time now) { return Take(0.0, now); }
  // That may be made at a time: what all its connections make at once is soon paid for.
  std::size_t batch_bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_per_s_ <= 0.0
               ? std::numeric_limits<std::size_t>::max()
               : static_cast<std::size_t>(std::max(1.0, bytes_per_s_ * kSecondsPerBatch));
  }
  bool IsRested(Time now) const {
    const std::lock_guard lock(mutex_);
    return bytes_.IsFull(now);
  }
  void set_rate(double bytes_per_s) {
    const std::lock_guard lock(mutex_);
    bytes_per_s_ = bytes_per_s;
    bytes_.set_rate(bytes_per_s);
  }

 private:
  static constexpr double kSecondsPerBatch = 1.0 / 16;

  Duration Take(double bytes, Time now) {
    const std::lock_guard lock(mutex_);
    return bytes_.Take(bytes, now);
  }

  mutable std::mutex mutex_;
  double bytes_per_s_;
  TokenBucket bytes_;
};

}  // namespace atlas
