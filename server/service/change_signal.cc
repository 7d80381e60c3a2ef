#include "server/service/change_signal.h"

namespace atlas {

std::uint64_t ChangeSignal::version() const {
  const std::lock_guard lock(mutex_);
  return version_;
}

void ChangeSignal::Notify() {
  {
    const std::lock_guard lock(mutex_);
    ++version_;
  }
  changed_.notify_all();
}

bool ChangeSignal::WaitPast(std::uint64_t seen, TimePoint deadline, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, stop, deadline,
                      [this, seen] { return is_closed_ || version_ != seen; });
  return !is_closed_ && version_ != seen && !stop.stop_requested();
}

void ChangeSignal::Close() {
  {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
  }
  changed_.notify_all();
}

bool ChangeSignal::is_closed() const {
  const std::lock_guard lock(mutex_);
  return is_closed_;
}

}  // namespace atlas
