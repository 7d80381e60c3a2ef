// How fast new connections are taken. One that comes and goes again and again costs more than any
// other, a TLS handshake each time: beyond so many short visits a second whoever comes next waits
// in the system's queue, and those who are there are served. Thread-safe.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <utility>

#include "server/net/connection/token_bucket.h"
#include "server/net/places.h"

namespace atlas {

class VisitPace {
 public:
  using Clock = std::chrono::steady_clock;

  struct Options {
    double short_visits_per_s = 200;  // 0: no limit
    Clock::duration short_visit = std::chrono::seconds(1);
    double gone_to_one = 20;  // of those who never began, for one visit
    Clock::duration max_pause = std::chrono::milliseconds(100);  // whatever was before
  };

  explicit VisitPace(const Options& options)
      : options_(options), allowed_(options.short_visits_per_s) {}

  // A place that tells, when it is given back, how long it was taken. May outlive this.
  Places::Place Begin(Places::Place place, Clock::time_point now) {
    return std::make_shared<Visit>(std::move(place), ended_, now + options_.short_visit);
  }
  // Of somebody who was not let in at all.
  void NoteRefusal() { ended_->fetch_add(1); }
  // Of somebody who was gone before it was his turn: that costs next to nothing, and who stands
  // behind him in the queue is not to wait for it. For one thread, as is the next.
  void NoteGone() { gone_ += 1.0; }

  // Before the next one is taken.
  Clock::duration Pause(Clock::time_point now) {
    const double gone = std::exchange(gone_, 0.0) / options_.gone_to_one;
    const double ended = static_cast<double>(ended_->exchange(0)) + gone;
    return std::min(allowed_.Take(ended, now), options_.max_pause);
  }

 private:
  using Count = std::atomic<std::size_t>;

  struct Visit {
    Visit(Places::Place taken, std::shared_ptr<Count> count, Clock::time_point until)
        : place(std::move(taken)), ended(std::move(count)), short_until(until) {}
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;
    ~Visit() {
      if (Clock::now() < short_until) {
        ended->fetch_add(1);
      }
    }

    Places::Place place;
    std::shared_ptr<Count> ended;
    Clock::time_point short_until;
  };

  Options options_;
  TokenBucket allowed_;
  double gone_ = 0.0;                                          // since the last pause
  std::shared_ptr<Count> ended_ = std::make_shared<Count>(0);  // short ones since the last pause
};

}  // namespace atlas
