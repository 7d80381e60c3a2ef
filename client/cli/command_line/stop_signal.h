// SIGINT and SIGTERM as something to wait for, for commands that run until they are told to end and
// end well then.
#pragma once

#include <atomic>
#include <chrono>

#include <signal.h>

namespace atlas {

// Made before the threads that ask it: they inherit that nobody else takes the two. One at a time.
class StopSignal {
 public:
  // Signals that are ignored stay so.
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  StopSignal(StopSignal&&) = delete;
  StopSignal& operator=(StopSignal&&) = delete;

  // Any thread may ask; once it has come, it has.
  bool HasCome();
  // So long, or until it comes.
  void Sleep(std::chrono::milliseconds time);

 private:
  sigset_t signals_{};
  sigset_t before_{};
  std::atomic<bool> has_come_{false};
};

}  // namespace atlas
