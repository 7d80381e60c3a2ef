// Sessions as the store knows them: what a vehicle's drive has contributed, and whether it is in
// the map.
#pragma once

#include <cstdint>
#include <string>

#include "core/geometry/keyframe_key.h"
#include "core/geometry/session_action.h"

namespace atlas {

// Frozen numbers (docs/formats/store.md). Only kLive and kRetracted occur yet.
enum class SessionState : std::uint8_t { kStaged = 0, kLive = 1, kQuarantined = 2, kRetracted = 3 };

// The map is made of the keyframes of such sessions.
inline bool IsInMap(SessionState state) {
  return state == SessionState::kLive;
}

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
};

struct SessionChangeResult {
  SessionState state = SessionState::kLive;  // after it
  bool is_changed = false;
  std::uint32_t tiles_marked = 0;  // of each session that changed
  std::uint64_t revision = 0;
  std::uint32_t sessions = 0;  // that changed
};

}  // namespace atlas
