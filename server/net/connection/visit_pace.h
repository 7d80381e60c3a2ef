// How fast new connections are taken. One that comes and goes again and again costs more than any
// other, a TLS handshake each time: beyond so much of that a second whoever comes next waits in the
// system's queue, and those who are there are served. Thread-safe.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "server/net/connection/token_bucket.h"

namespace atlas {

// What became of one who came, and so what it cost.
enum class VisitKind : std::uint8_t {
  kFull,    // it sent something
  kSilent,  // it was begun and sent nothing, or was told that there is no place
  kGone,    // it was gone before its turn, or closed where it was accepted
};

class VisitPace {
 public:
  using Clock = std::chrono::steady_clock;

  // So many a second of each kind alone.
  struct Options {
    double full_per_s = 200;  // 0: no limit of any kind
    double silent_per_s = 2'000;
    double gone_per_s = 4'000;
    Clock::duration max_pause = std::chrono::milliseconds(100);  // whatever was before
  };

  explicit VisitPace(const Options& options) : options_(options), allowed_(options.full_per_s) {}

  // From any thread.
  void Note(VisitKind kind) { ended_[static_cast<std::size_t>(kind)].fetch_add(1); }
  // In full ones.
  double CostOf(VisitKind kind, double visits = 1.0) const {
    switch (kind) {
      case VisitKind::kSilent:
        return visits * options_.full_per_s / options_.silent_per_s;
      case VisitKind::kGone:
        return visits * options_.full_per_s / options_.gone_per_s;
      case VisitKind::kFull:
        break;
    }
    return visits;
  }

  // Before the next one is taken. For one thread.
  Clock::duration Pause(Clock::time_point now) {
    double cost = 0.0;
    for (const VisitKind kind : {VisitKind::kFull, VisitKind::kSilent, VisitKind::kGone}) {
      auto& ended = ended_[static_cast<std::size_t>(kind)];
      cost += CostOf(kind, static_cast<double>(ended.exchange(0)));
    }
    return std::min(allowed_.Take(cost, now), options_.max_pause);
  }

 private:
  const Options options_;
  TokenBucket allowed_;
  std::array<std::atomic<std::size_t>, 3> ended_{};  // since the last pause, by kind
};

}  // namespace atlas
