#include "server/service/compaction/compaction_window.h"

#include <algorithm>

namespace atlas {
namespace {

double CountWithin(std::span<const SessionRecord> sessions,
                   std::int64_t from_ms,
                   std::int64_t end_ms) {
  double count = 0;
  for (const SessionRecord& session : sessions) {
    const std::int64_t session_end_ms = session.last_time_ms + 1;
    const auto length_ms = static_cast<double>(session_end_ms - session.first_time_ms);
    const std::int64_t within_ms =
        std::min(session_end_ms, end_ms) - std::max(session.first_time_ms, from_ms);
    if (within_ms > 0) {
      count += static_cast<double>(session.keyframes) * static_cast<double>(within_ms) / length_ms;
    }
  }
  return count;
}

}  // namespace

std::optional<std::int64_t> EndOfWindow(std::span<const SessionRecord> sessions,
                                        std::int64_t from_ms,
                                        std::uint64_t keyframes) {
  std::int64_t last_ms = from_ms;  // an end at which there are enough, or all
  for (const SessionRecord& session : sessions) {
    if (session.keyframes > 0) {
      last_ms = std::max(last_ms, session.last_time_ms + 1);
    }
  }
  if (last_ms == from_ms) {
    return std::nullopt;
  }
  std::int64_t first_ms = from_ms;  // an end at which there are not
  while (last_ms - first_ms > 1) {
    const std::int64_t middle_ms = first_ms + (last_ms - first_ms) / 2;
    const bool is_enough =
        CountWithin(sessions, from_ms, middle_ms) >= static_cast<double>(keyframes);
    (is_enough ? last_ms : first_ms) = middle_ms;
  }
  return last_ms;
}

}  // namespace atlas
