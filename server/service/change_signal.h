// Wakes whoever waits for the atlas to change: workers for marks, clients for a clean map.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <stop_token>

namespace atlas {

class ChangeSignal {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  // Read before looking at the store, so that no change in between is missed.
  std::uint64_t version() const;
  void Notify();
  // Until something changed after `seen`; false at the deadline, on `stop` and after Close().
  bool WaitPast(std::uint64_t seen, TimePoint deadline, const std::stop_token& stop);
  // Wakes everyone for good.
  void Close();
  bool is_closed() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::uint64_t version_ = 0;
  bool is_closed_ = false;
};

}  // namespace atlas
