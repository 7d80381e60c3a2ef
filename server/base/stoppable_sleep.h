// A sleep that a stop ends.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace atlas {

// True when it is to stop.
inline bool SleepUnlessStopped(const std::stop_token& stop,
                               std::chrono::steady_clock::duration time) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, time, [] { return false; });
  return stop.stop_requested();
}

}  // namespace atlas
