// When a fusion worker rests: where others want its core. To be merely nice is not enough there;
// whoever wakes up finds the core taken, and has to have it freed first.
#pragma once

#include <chrono>
#include <functional>
#include <stop_token>

namespace atlas {

// For one thread.
class WorkerPace {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  struct Options {
    int rest_to_wait = 3;  // 0: never rests
    std::chrono::milliseconds min_wait{1};
    std::chrono::milliseconds max_rest{2'000};
  };

  // `without_core` tells how long the thread has been ready and without a core, in all.
  WorkerPace(std::function<Nanoseconds()> without_core, const Options& options);

  // Between two pieces of work. Rests for some times as long as the thread had to wait for its core
  // since the last call: with three, who gets little of a core wants it a quarter of the time. Ends
  // on `stop`.
  void Rest(const std::stop_token& stop);

 private:
  std::function<Nanoseconds()> without_core_;
  Options options_;
  Nanoseconds seen_;
};

}  // namespace atlas
