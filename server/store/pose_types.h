// Corrections of poses: a batch of them, what came of it, and a batch that is to be undone.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/geometry/keyframe_key.h"
#include "core/geometry/plausibility.h"
#include "core/geometry/pose.h"
#include "core/geometry/tile_id.h"
#include "server/store/session_types.h"

namespace atlas {

// That one batch may publish.
inline constexpr std::size_t kMaxPublishedSessions = 1'000;

struct NewPose {
  KeyframeKey key;
  QuantizedPose pose;
  std::vector<TileId> footprint;  // at `pose`
};

struct PoseBatch {
  std::vector<NewPose> poses;
  std::string author;
  // 0, or the revision that it was computed at: nothing of its sessions may have changed since.
  std::uint64_t if_revision = 0;
  std::vector<SessionKey> published = {};  // staged sessions that it puts into the map
  // A session that comes into the map is judged by them; none: it is live.
  std::optional<PlausibilityLimits> limits = {};

  // That it is about.
  std::set<SessionKey> Sessions() const {
    std::set<SessionKey> sessions(published.begin(), published.end());
    for (const NewPose& update : poses) {
      sessions.insert(update.key.session);
    }
    return sessions;
  }
};

// A session that a batch put into another state.
struct ChangedSession {
  SessionKey key;
  SessionJudgement entered;  // the state that it is in now

  // It was staged, and is not any more.
  bool is_published() const { return entered.state != SessionState::kStaged; }
};

struct PoseBatchResult {
  std::uint32_t updated = 0;
  std::uint32_t compacted = 0;  // of keyframes that compactions dropped: nothing to move
  std::uint32_t tiles_marked = 0;
  std::uint64_t revision = 0;
  std::uint64_t batch = 0;
  std::vector<ChangedSession> sessions = {};
};

// A batch as its row says it.
struct StoredBatch {
  std::uint64_t id = 0;
  std::uint64_t revision = 0;  // of the atlas after it
  std::string author;
  std::uint64_t updated = 0;  // poses
  std::uint64_t if_revision = 0;
};

// One that is to be undone: each pose as it was before it.
struct PoseUndo {
  std::uint64_t batch = 0;
  std::vector<NewPose> poses;  // all that it changed
  std::string author;
  std::optional<PlausibilityLimits> limits = {};  // of sessions that come into the map by it
};

}  // namespace atlas
