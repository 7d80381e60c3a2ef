#include "server/store/session_starts.h"

#include <algorithm>

#include "core/base/str_cat.h"

namespace atlas {

Result<SessionStarts::Clock::duration> SessionStarts::Begin(const std::string& vehicle,
                                                            Clock::time_point now) {
  constexpr std::chrono::hours kHour{1};
  const std::lock_guard lock(mutex_);
  if (per_hour_ == 0) {
    return Clock::duration(0);
  }
  if (rested_at_.size() >= kMaxVehicles && !rested_at_.contains(vehicle)) {
    ForgetRested(now);
  }
  Clock::time_point& rested_at = rested_at_.try_emplace(vehicle, now).first->second;
  const Clock::duration counted = Clock::duration(kHour) / per_hour_;
  const Clock::time_point next = std::max(rested_at, now) + counted;
  if (next > now + kHour) {
    const Clock::duration wait = next - now - kHour;
    const Status refused(StatusCode::kUnavailable,
                         StrCat("vehicle ", vehicle, " began as many sessions as it may, ",
                                per_hour_, " an hour: the next one may begin in ",
                                std::chrono::ceil<std::chrono::seconds>(wait).count(), " s"));
    return Error(
        refused.WithRetryAfter(std::chrono::ceil<std::chrono::milliseconds>(wait).count()));
  }
  rested_at = next;
  return counted;
}

void SessionStarts::GiveBack(const std::string& vehicle, Clock::duration counted) {
  const std::lock_guard lock(mutex_);
  const auto rested_at = rested_at_.find(vehicle);
  if (rested_at != rested_at_.end()) {
    rested_at->second -= counted;
  }
}

void SessionStarts::ForgetRested(Clock::time_point now) {
  std::erase_if(rested_at_, [now](const auto& entry) { return entry.second <= now; });
  if (rested_at_.size() > kMaxVehicles / 2) {  // else it would be looked through again and again
    rested_at_.clear();
  }
}

Status SessionStart::Begin(const std::string& vehicle, SessionStarts::Clock::time_point now) {
  if (counted_ != SessionStarts::Clock::duration{0}) return {};  // its write is made once more
  const Result<SessionStarts::Clock::duration> counted = starts_->Begin(vehicle, now);
  if (!counted) {
    return counted.error();
  }
  vehicle_ = vehicle;
  counted_ = *counted;
  return {};
}

void SessionStart::NoteEnd(const Status& status) {
  if (!status.ok()) {
    starts_->GiveBack(vehicle_, counted_);
  }
}

}  // namespace atlas
