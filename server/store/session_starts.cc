#include "server/store/session_starts.h"

#include <algorithm>

#include "core/base/str_cat.h"

namespace atlas {

Status SessionStarts::Begin(const std::string& vehicle, Clock::time_point now) {
  constexpr std::chrono::hours kHour{1};
  const std::lock_guard lock(mutex_);
  if (per_hour_ == 0) {
    return {};
  }
  if (rested_at_.size() >= kMaxVehicles && !rested_at_.contains(vehicle)) {
    ForgetRested(now);
  }
  Clock::time_point& rested_at = rested_at_.try_emplace(vehicle, now).first->second;
  const Clock::time_point next = std::max(rested_at, now) + Clock::duration(kHour) / per_hour_;
  if (next > now + kHour) {
    const auto wait = std::chrono::ceil<std::chrono::seconds>(next - now - kHour);
    return {StatusCode::kUnavailable,
            StrCat("vehicle ", vehicle, " began as many sessions as it may, ", per_hour_,
                   " an hour: the next one may begin in ", wait.count(), " s")};
  }
  rested_at = next;
  return {};
}

void SessionStarts::ForgetRested(Clock::time_point now) {
  std::erase_if(rested_at_, [now](const auto& entry) { return entry.second <= now; });
  if (rested_at_.size() > kMaxVehicles / 2) {  // else it would be looked through again and again
    rested_at_.clear();
  }
}

}  // namespace atlas
