// A rate with some patience: a second's worth may come at once, what is above has to wait. Pure:
// the time is passed in.
#pragma once

#include <algorithm>
#include <chrono>

namespace atlas {

class TokenBucket {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  // 0: no limit.
  explicit TokenBucket(double per_s) : per_s_(per_s), tokens_(per_s) {}

  // From now on; what is owed stays owed.
  void set_rate(double per_s) {
    per_s_ = per_s;
    tokens_ = std::min(tokens_, per_s);
  }
  // What was taken is there again: it is as one that is new.
  bool IsFull(Time now) const {
    const std::chrono::duration<double> passed = now - last_;
    return per_s_ <= 0.0 || tokens_ + per_s_ * passed.count() >= per_s_;
  }
  // Takes them, whether they are there or not; how long to wait before anything else comes.
  Duration Take(double amount, Time now) {
    if (per_s_ <= 0.0) {
      return Duration::zero();
    }
    const std::chrono::duration<double> passed = now - last_;
    last_ = now;
    tokens_ = std::min(per_s_, tokens_ + per_s_ * passed.count()) - amount;
    return tokens_ >= 0.0 ? Duration::zero()
                          : std::chrono::duration_cast<Duration>(
                                std::chrono::duration<double>(-tokens_ / per_s_));
  }

 private:
  double per_s_;
  double tokens_;
  Time last_{};  // long ago: it begins full
};

}  // namespace atlas
