// How many sessions each vehicle began lately: an hour's worth may begin at once, and then as many
// an hour. Sessions stay for good, and everybody who asks for them is told of all: a vehicle that
// runs wild must not make them by the thousand. Kept in memory: no vehicle restarts the daemon.
// Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "core/base/status.h"

namespace atlas {

class SessionStarts {
 public:
  using Clock = std::chrono::steady_clock;

  // 0: no limit.
  explicit SessionStarts(std::uint32_t per_hour) : per_hour_(per_hour) {}

  // From now on; what was begun stays counted.
  void set_per_hour(std::uint32_t per_hour) {
    const std::lock_guard lock(mutex_);
    per_hour_ = per_hour;
  }
  // It begins one: what that counts for, to be given back if nothing comes of it. kUnavailable: not
  // yet, with the wait.
  Result<Clock::duration> Begin(const std::string& vehicle, Clock::time_point now);
  void GiveBack(const std::string& vehicle, Clock::duration counted);
  // Whose sessions are counted.
  std::size_t vehicles() const {
    const std::lock_guard lock(mutex_);
    return rested_at_.size();
  }

  // Beyond it the count begins anew: only who may upload for any vehicle gets there.
  static constexpr std::size_t kMaxVehicles = 65'536;

 private:
  void ForgetRested(Clock::time_point now);

  mutable std::mutex mutex_;
  std::uint32_t per_hour_;
  std::map<std::string, Clock::time_point> rested_at_;  // when nothing counts any more, by vehicle
};

// The session that one upload may begin: counted at once, for those behind it, and as long as the
// upload does not fail. One thread at a time.
class SessionStart {
 public:
  explicit SessionStart(std::shared_ptr<SessionStarts> starts) : starts_(std::move(starts)) {}

  // It begins one. kUnavailable: not yet, with the wait.
  Status Begin(const std::string& vehicle, SessionStarts::Clock::time_point now);
  // What became of the upload.
  void NoteEnd(const Status& status);

 private:
  const std::shared_ptr<SessionStarts> starts_;  // of all
  std::string vehicle_;
  SessionStarts::Clock::duration counted_{0};
};

}  // namespace atlas
