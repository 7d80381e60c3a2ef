#include "server/service/fusion/worker_pace.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace atlas {

WorkerPace::WorkerPace(std::function<Nanoseconds()> without_core, const Options& options)
    : without_core_(std::move(without_core)), options_(options), seen_(without_core_()) {}

void WorkerPace::Rest(const std::stop_token& stop) {
  const Nanoseconds now = without_core_();
  const Nanoseconds waited = now - std::exchange(seen_, now);
  if (options_.rest_to_wait == 0 || waited < options_.min_wait) {
    return;
  }
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any only_stopped;
  only_stopped.wait_for(lock, stop,
                        std::min<Nanoseconds>(options_.rest_to_wait * waited, options_.max_rest),
                        [] { return false; });
  seen_ = without_core_();  // to get it back counts for nothing
}

}  // namespace atlas
