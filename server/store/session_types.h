// Sessions as the store knows them: what a vehicle's drive has contributed, and whether it is in
// the map.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/keyframe_key.h"
#include "core/geometry/plausibility.h"
#include "core/geometry/session_action.h"

namespace atlas {

// Frozen numbers (docs/formats/store.md).
enum class SessionState : std::uint8_t {
  kStaged = 0,  // kept, and not in the map until somebody publishes it
  kLive = 1,
  kQuarantined = 2,  // a way along its keyframes is implausible (plausibility.h)
  kRetracted = 3,
  kReleased = 4,  // live, whatever its keyframes look like: somebody said so
  kPurged = 5,    // nothing is left of it but its name, which takes no keyframes any more
};

// The map is made of the keyframes of such sessions.
inline bool IsInMap(SessionState state) {
  return state == SessionState::kLive || state == SessionState::kReleased;
}

// As messages and people name it (docs/protocol.md).
constexpr std::string_view SessionStateName(SessionState state) {
  switch (state) {
    case SessionState::kStaged:
      return "staged";
    case SessionState::kLive:
      return "live";
    case SessionState::kQuarantined:
      return "quarantined";
    case SessionState::kRetracted:
      return "retracted";
    case SessionState::kReleased:
      return "released";
    case SessionState::kPurged:
      return "purged";
  }
  return "unknown";  // of a later version
}

// What a list of sessions found wrong with one of them.
enum class SessionDamage : std::uint8_t {
  kNone,
  kHistory,  // of its states: why it is in this one is not known
  kRow,      // nothing of it is known but its name
};

// The times and the last sequence are those of all keyframes that were ever uploaded.
struct SessionRecord {
  SessionKey key;
  SessionState state = SessionState::kLive;
  std::uint64_t keyframes = 0;  // that are stored
  std::uint64_t bytes = 0;
  std::int64_t first_time_ms = 0;
  std::int64_t last_time_ms = 0;
  std::uint32_t last_sequence = 0;
  std::uint64_t compacted = 0;  // keyframes that compactions dropped
  std::string reason = {};      // of its state, unless it is live; may be empty. Or of its damage
  SessionDamage damage = SessionDamage::kNone;  // of one that is listed; others are an error
  // The last revision at which anything about it changed (session_changes.h). 0: nobody asked, or
  // its row is damaged.
  std::uint64_t changed_revision = 0;
};

// A page of them, by vehicle and session.
struct SessionPage {
  std::vector<SessionRecord> sessions;
  bool has_more = false;  // behind the last one
};

// No keyframe was uploaded yet.
inline bool HasNoneYet(const SessionRecord& session) {
  return session.keyframes + session.compacted == 0;
}

struct SessionChange {
  SessionKey key;  // without a session: all of the vehicle's
  SessionAction action = SessionAction::kRetract;
  std::string author;
  std::string reason;
  // A restored session is judged by them; none: it becomes what it was.
  std::optional<PlausibilityLimits> limits = {};
};

struct SessionChangeResult {
  SessionState state = SessionState::kLive;  // after it
  bool is_changed = false;
  std::uint32_t tiles_marked = 0;  // of each session that changed
  std::uint64_t revision = 0;
  std::uint32_t sessions = 0;   // that changed
  std::uint64_t keyframes = 0;  // that were deleted
};

// The state that a session is in because of what its keyframes look like.
struct SessionJudgement {
  SessionState state = SessionState::kLive;
  std::string reason;  // for people
};

}  // namespace atlas
