// What goes into an AtlasStore and what comes out of it: plain values, no storage engine in sight.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/grid_geometry.h"
#include "core/geometry/keyframe_key.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "core/geometry/tile_id.h"
#include "server/store/missing_uploads.h"
#include "server/store/pose_types.h"
#include "server/store/session_starts.h"
#include "server/store/session_types.h"

namespace atlas {

// Those between the two may have been given to what is lost.
struct LostRevisions {
  std::uint64_t after = 0;
  std::uint64_t before = 0;

  friend bool operator==(const LostRevisions&, const LostRevisions&) = default;
};

// Fixed when the atlas was created.
struct StoreIdentity {
  MapProfile profile;
  std::array<std::uint8_t, 16> atlas_id{};
  std::uint64_t epoch = 1;  // moves when the atlas goes on from an earlier revision (new_line.h)
  // Those left out before it went on.
  std::vector<LostRevisions> lost = {};

  // kNotFound: a revision that is lost.
  Status CheckNotLost(std::uint64_t revision) const;
};

// The atlas was opened and changed: what it was given until it was opened next goes on from this
// revision.
struct AtlasStart {
  std::array<std::uint8_t, 16> id{};  // random
  std::uint64_t revision = 0;

  friend bool operator==(const AtlasStart&, const AtlasStart&) = default;
};

// How it came to be what it is. One that was put back from a copy begins another line: what was
// kept elsewhere of a later revision is not of it, and its starts tell.
struct AtlasLine {
  std::vector<AtlasStart> starts;  // the last hundred, oldest first
  std::uint64_t revision = 0;      // that it stands at
};

struct PositionPrior {
  std::int64_t x_um = 0;
  std::int64_t y_um = 0;
  std::int64_t z_um = 0;
  std::uint32_t radius_mm = 0;
};

struct NewKeyframe {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  QuantizedPose pose;
  GridGeometry grid;  // of the blob's header, as is the next
  std::array<std::int32_t, 4> level_quaternion{};
  std::optional<PositionPrior> prior;
  Bytes blob;
  bool is_staged = false;                    // the session that it begins, if it does
  std::vector<TileId> footprint;             // the level-0 tiles it touches at `pose`
  std::shared_ptr<MissingUploads> missing;   // of who sends it; null: order does not matter
  std::shared_ptr<SessionStart> start;       // of its session; null: as many as they like
  std::optional<PlausibilityLimits> limits;  // none: its session is not judged
};

struct PutKeyframeResult {
  bool is_duplicate = false;
  std::uint64_t revision = 0;
  std::uint32_t tiles_marked = 0;
  std::optional<SessionJudgement> judgement = {};  // that put its session into another state
};

// A stored keyframe without its blob: enough to place it on the map.
struct KeyframeRecord {
  std::int64_t id = 0;
  KeyframeKey key;
  std::int64_t time_ms = 0;
  GridGeometry grid;
  std::array<std::int32_t, 4> level_quaternion{};
  QuantizedPose pose;
  SessionState session_state = SessionState::kLive;
};

// A page of a session's stored keyframes, by rising sequence number.
struct KeyframePage {
  std::vector<KeyframeRecord> keyframes;
  bool has_more = false;  // behind the last one
};

// What a batch of corrections changed, and what undoes it.
struct BatchToUndo {
  struct Moved {
    KeyframeRecord keyframe;
    QuantizedPose before;  // the batch
  };
  std::uint64_t batch = 0;
  std::vector<Moved> keyframes;  // by their keys
};

struct StoredKeyframe {
  KeyframeRecord record;
  std::vector<TileId> footprint;  // at its present pose, in key order
};

// Of each key asked for; nullopt: a compaction dropped it.
using FoundKeyframes = std::vector<std::optional<KeyframeRecord>>;

// What a level-0 tile is fused from, read in one snapshot.
struct TileSources {
  std::uint64_t revision = 0;  // of the atlas, or the earlier one asked for
  std::vector<KeyframeRecord> keyframes;
  std::vector<std::int64_t> gone;  // ids that do not belong to it, and may have before
  bool is_whole = false;           // all of it, not only what changed
};

struct TileContent {
  Bytes blob;
  std::uint64_t payload_hash = 0;
  std::uint32_t cells = 0;             // with a layer
  std::uint32_t multilayer_cells = 0;  // with two or more
};

struct TileSummary {
  TileId id;
  std::uint64_t revision = 0;
  std::uint64_t payload_hash = 0;
  std::uint32_t blob_bytes = 0;
};

struct StoredTile {
  TileId id;
  std::uint64_t revision = 0;
  std::uint64_t payload_hash = 0;
  Bytes blob;
};

// `since` of tiles that are not to be trusted: nor is what was kept to fuse them with.
inline constexpr std::uint64_t kReflectsNothing = 1;

// A right to build one dirty tile.
struct TileClaim {
  TileId id;
  std::string owner;
  std::uint64_t generation = 0;  // the revision that marked it last
  std::uint64_t since = 0;       // the first revision that the tile does not reflect
  std::uint32_t attempts = 0;    // that failed since it was marked
};

struct ClaimRequest {
  std::string owner;  // one name a worker: a lease that ran out may be another's already
  std::int64_t now_ms = 0;
  std::int64_t lease_ms = 0;
  std::uint32_t max_tiles = 1;
  std::uint64_t wave = 0;  // only marks whose `since` is at most this revision
};

struct ClaimResult {
  std::vector<TileClaim> claims;
  bool is_wave_done = false;  // no mark of the wave is left, claimed or not
};

struct FinishedTile {
  TileClaim claim;
  std::uint64_t fused_revision = 0;    // of the snapshot that it was made from
  std::optional<TileContent> content;  // none: the tile is empty
};

struct FinishResult {
  bool is_changed = false;
  std::uint64_t revision = 0;  // the tile's, if it changed
};

struct DirtyState {
  std::uint64_t revision = 0;
  std::uint64_t dirty_tiles = 0;
  std::uint64_t oldest_since = 0;  // lowest `since` of all marks; 0 without marks
  // Where each of them was tried since it was marked last, and failed: all. Else none.
  std::vector<TileId> failed_tiles;
};

struct StoreCounts {
  std::uint64_t revision = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t keyframe_bytes = 0;
  std::uint64_t compacted = 0;  // keyframes that compactions dropped
  std::uint64_t sessions = 0;
  std::uint64_t quarantined = 0;  // of the sessions
  std::uint64_t tiles = 0;
  std::uint64_t tile_bytes = 0;
  std::uint64_t cells = 0;             // level 0
  std::uint64_t multilayer_cells = 0;  // level 0
  std::uint64_t dirty_tiles = 0;
  std::uint64_t store_bytes = 0;
};

// Tile coordinates of one level, both ends included.
struct TileRect {
  std::uint8_t level = 0;
  std::int32_t min_x = TileId::kMinCoordinate;
  std::int32_t min_y = TileId::kMinCoordinate;
  std::int32_t max_x = TileId::kMaxCoordinate;
  std::int32_t max_y = TileId::kMaxCoordinate;

  bool Contains(const TileId& id) const {
    return id.level == level && id.x >= min_x && id.x <= max_x && id.y >= min_y && id.y <= max_y;
  }
};

}  // namespace atlas
