// A line of the log about something that is tried again and again and fails: said when it begins to
// fail, or fails for another reason, counted while it goes on, and summed up when it is over.
// Thread-safe.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

namespace atlas {

class RepeatedLine {
 public:
  // It failed. True: say so; false: that was said.
  bool Fails(const std::string& why) {
    const std::lock_guard lock(mutex_);
    ++failures_;
    return std::exchange(why_, why) != why;
  }
  // It went well. How often it had failed since it was well before; 0: say nothing.
  std::uint64_t Succeeds() {
    const std::lock_guard lock(mutex_);
    why_.clear();
    return std::exchange(failures_, 0);
  }

 private:
  std::mutex mutex_;
  std::string why_;
  std::uint64_t failures_ = 0;
};

}  // namespace atlas
