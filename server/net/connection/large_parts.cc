#include "server/net/connection/large_parts.h"

#include <algorithm>

namespace atlas {

LargeParts::Part::Part(LargeParts& all, std::function<void()> close)
    : all_(all), close_(std::move(close)) {
  const std::lock_guard lock(all_.mutex_);
  all_.parts_.insert(this);
}

LargeParts::Part::~Part() {
  const std::lock_guard lock(all_.mutex_);
  all_.bytes_ -= bytes_;
  all_.parts_.erase(this);
}

bool LargeParts::Part::Set(std::size_t bytes, Time deadline) {
  deadline_ = deadline.time_since_epoch().count();
  const std::size_t before = bytes_.exchange(bytes);
  if (bytes <= before) {
    all_.bytes_ -= before - bytes;
    return true;
  }
  return (all_.bytes_ += bytes - before) <= all_.max_bytes_ || all_.MakeRoom(*this);
}

// What is closing counts until it is gone, and makes room at once.
bool LargeParts::MakeRoom(const Part& newest) {
  const std::lock_guard lock(mutex_);
  std::size_t staying_bytes = 0;
  for (const Part* const part : parts_) {
    staying_bytes += part->is_closing_ ? 0 : part->bytes_.load();
  }
  while (staying_bytes > max_bytes_) {
    Part* const slowest = Slowest();
    if (slowest == nullptr || slowest == &newest) {
      ++closed_;
      return false;
    }
    staying_bytes -= std::min(staying_bytes, slowest->bytes_.load());
    slowest->is_closing_ = true;
    ++closed_;
    slowest->close_();
  }
  return true;
}

LargeParts::Part* LargeParts::Slowest() const {
  Part* slowest = nullptr;
  Time::rep deadline = Time::max().time_since_epoch().count();
  for (Part* const part : parts_) {
    if (!part->is_closing_ && part->bytes_ > 0 && part->deadline_ < deadline) {
      slowest = part;
      deadline = part->deadline_;
    }
  }
  return slowest;
}

}  // namespace atlas
