#include "server/http/liveness.h"

#include <condition_variable>
#include <mutex>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

struct Liveness::Answer {
  using TimePoint = std::chrono::steady_clock::time_point;

  // False: the last question is not answered yet.
  bool BeginWait() {
    const std::lock_guard lock(mutex);
    return !std::exchange(is_owed, true);
  }
  void Come() {
    const std::lock_guard lock(mutex);
    is_owed = false;
    came.notify_all();
  }
  bool WaitUntil(TimePoint deadline) {
    std::unique_lock lock(mutex);
    return came.wait_until(lock, deadline, [this] { return !is_owed; });
  }

  std::mutex mutex;
  std::condition_variable came;
  bool is_owed = false;
};

Liveness::Liveness(std::vector<Pulse> pulses, std::chrono::milliseconds patience)
    : patience_(patience) {
  for (Pulse& pulse : pulses) {
    all_.push_back({std::move(pulse), std::make_shared<Answer>()});
  }
}

Status Liveness::Check() {
  for (const Asked& asked : all_) {
    if (asked.answer->BeginWait()) {
      asked.pulse.ask([answer = asked.answer] { answer->Come(); });
    }
  }
  const auto deadline = std::chrono::steady_clock::now() + patience_;
  std::string silent;
  for (const Asked& asked : all_) {
    if (!asked.answer->WaitUntil(deadline)) {
      silent += StrCat(silent.empty() ? "" : ", ", asked.pulse.name);
    }
  }
  return silent.empty() ? Status()
                        : Status(StatusCode::kTimeout,
                                 StrCat("no answer within ", patience_.count(), " ms: ", silent));
}

}  // namespace atlas
