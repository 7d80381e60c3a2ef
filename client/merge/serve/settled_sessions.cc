#include "client/merge/serve/settled_sessions.h"

#include <utility>

namespace atlas {

SessionMark MarkOf(const SessionSummary& session) {
  return {session.state,         session.keyframes, session.bytes,
          session.last_sequence, session.compacted, session.is_damaged};
}

void SettledSessions::Look(const std::vector<SessionSummary>& sessions, Clock::time_point now) {
  std::map<SessionKey, Seen> seen;
  for (const SessionSummary& session : sessions) {
    SessionMark mark = MarkOf(session);
    const auto before = seen_.find(session.key);
    const bool is_alike = before != seen_.end() && before->second.mark == mark;
    seen[session.key] = {std::move(mark), is_alike ? before->second.since : now};
  }
  seen_ = std::move(seen);
}

std::map<SessionKey, SessionMark> SettledSessions::Settled(Clock::time_point now) const {
  std::map<SessionKey, SessionMark> settled;
  for (const auto& [key, seen] : seen_) {
    if (now - seen.since >= settle_) settled.emplace(key, seen.mark);
  }
  return settled;
}

}  // namespace atlas
