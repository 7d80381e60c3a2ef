// Which sessions nobody uploads to any more, told by lists of a daemon's sessions that follow each
// other: no session says that it is complete, it only stops growing. One thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client/connection/requests.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

// What a list tells of a session that grows, or that somebody does something to; poses apart.
struct SessionMark {
  std::string state;
  std::uint64_t keyframes = 0;
  std::uint64_t bytes = 0;
  std::uint32_t last_sequence = 0;
  std::uint64_t compacted = 0;
  bool is_damaged = false;

  bool IsStaged() const { return state == "staged" && !is_damaged && keyframes > 0; }
  bool IsInMap() const { return state == "live" || state == "released"; }

  friend bool operator==(const SessionMark&, const SessionMark&) = default;
};

SessionMark MarkOf(const SessionSummary& session);

class SettledSessions {
 public:
  using Clock = std::chrono::steady_clock;

  // A session is settled that lists have shown alike for so long.
  explicit SettledSessions(std::chrono::milliseconds settle) : settle_(settle) {}

  // The whole list, as it was at `now`; what is not in it is forgotten.
  void Look(const std::vector<SessionSummary>& sessions, Clock::time_point now);

  std::map<SessionKey, SessionMark> Settled(Clock::time_point now) const;

 private:
  struct Seen {
    SessionMark mark;
    Clock::time_point since;
  };

  std::chrono::milliseconds settle_;
  std::map<SessionKey, Seen> seen_;
};

}  // namespace atlas
