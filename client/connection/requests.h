// What a client asks of a daemon and what it is told: plain values, no messages.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "client/connection/sync_query.h"
#include "core/base/bytes.h"
#include "core/geometry/keyframe_key.h"
#include "core/geometry/pose.h"
#include "core/geometry/session_action.h"
#include "core/geometry/tile_id.h"

namespace atlas {

// The atlas at the other end, as it was when the connection was made.
struct AtlasIdentity {
  Bytes atlas_id;
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
  std::uint32_t protocol_minor = 0;  // that its daemon speaks
  std::string our_name;              // whom it takes us for; empty: nobody in particular
  std::string our_role;  // "reader", "vehicle", "merge" or "admin"; empty: an older daemon
  // Of the session in ConnectionOptions::resume: the highest sequence number that is there. None:
  // nothing is, nothing was asked, or an older daemon (before 1.5).
  std::optional<std::uint32_t> last_sequence = std::nullopt;
};

// Where the sensor was in the world (the atlas's frame), known from elsewhere (GNSS).
struct KnownPosition {
  std::int64_t x_um = 0;
  std::int64_t y_um = 0;
  std::int64_t z_um = 0;
  std::uint32_t radius_mm = 0;  // one standard deviation along each axis; 0: nobody knows

  friend bool operator==(const KnownPosition&, const KnownPosition&) = default;
};

struct KeyframeUpload {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  QuantizedPose T_world_sensor;
  ByteSpan blob;
  // The session that it begins is staged: kept, and not in the map until it is published. Taken by
  // daemons of protocol 1.10 and later alone: others are not sent it (kUnsupported).
  bool is_staged = false;
  // Of a keyframe that is there already it changes nothing: the first one stays.
  std::optional<KnownPosition> prior = std::nullopt;
};

// What is known of a stored keyframe, but its blob.
struct KeyframeSummary {
  std::uint32_t sequence = 0;
  std::int64_t time_ms = 0;
  QuantizedPose T_world_sensor;  // as it is now
};

// A stored keyframe as it was uploaded, where it is now.
struct SessionKeyframe {
  std::uint32_t sequence = 0;
  std::int64_t time_ms = 0;      // since 1970
  QuantizedPose T_world_sensor;  // as it is now
  std::optional<KnownPosition> prior = std::nullopt;
  Bytes blob;  // docs/formats/keyframe.md
  // Not empty: it is damaged, and how; nothing but its sequence number is known.
  std::string damage;
};

// What became of a session's keyframes being read.
struct SessionReading {
  std::uint64_t keyframes = 0;  // damaged ones, too
  std::uint64_t damaged = 0;
  std::uint64_t revision = 0;  // of the atlas when it began: all that came is at least as new
};

struct PoseCorrection {
  KeyframeKey key;
  QuantizedPose T_world_sensor;
};

// Under which condition a batch of corrections is applied, and what else is done by it.
struct BatchTerms {
  // 0, or the revision that it was computed at: nothing may have changed since about the sessions
  // of its keyframes, and those that it publishes.
  std::uint64_t if_revision = 0;
  std::vector<SessionKey> published = {};  // staged ones, that come into the map by the same step
};

// A session that a batch put into another state.
struct SessionEntry {
  SessionKey key;
  std::string state;   // now: "live", "quarantined", or "staged" again
  std::string reason;  // of a quarantine
};

struct PoseBatchSummary {
  std::uint32_t updated = 0;
  std::uint32_t tiles_marked = 0;
  std::uint64_t revision = 0;
  std::uint64_t batch = 0;
  std::uint32_t compacted = 0;  // of keyframes that compactions dropped: nothing to move
  std::vector<SessionEntry> sessions = {};
};

// Without a disc: the whole atlas. Tiles come coarse first.
struct RegionQuery {
  struct Disc {
    Eigen::Vector2d center_m = Eigen::Vector2d::Zero();
    double radius_m = 0.0;
  };
  std::optional<Disc> disc;
  std::uint8_t finest_level = 0;
  bool is_only_finest = false;
  std::uint64_t budget_bytes = 0;  // 0: none
  // As the atlas was at that revision: fused again for this query, which may take long.
  std::optional<std::uint64_t> at_revision = std::nullopt;
  std::chrono::milliseconds at_timeout{600'000};
};

// A tile as it was encoded; DecodeTile makes a Tile of it.
struct TileBlob {
  TileId id;
  std::uint64_t revision = 0;
  std::uint64_t payload_hash = 0;
  Bytes blob;
  // Not 0, and only in a sync that takes deltas: the blob is one to the held content with this
  // hash. ApplyTileDelta makes the tile's blob of it.
  std::uint64_t base_hash = 0;
};

struct RegionSummary {
  std::uint64_t tiles = 0;
  std::uint64_t bytes = 0;  // of the reply's frames
  std::uint64_t revision = 0;
  bool is_truncated = false;
};

struct AtlasStatus {
  std::uint64_t revision = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t sessions = 0;
  std::uint64_t tiles = 0;
  std::uint64_t dirty_tiles = 0;
  std::uint64_t damaged_tiles = 0;  // of the dirty ones
  std::uint64_t store_bytes = 0;
  std::uint64_t tile_bytes = 0;
  std::uint64_t keyframe_bytes = 0;
  std::uint64_t cells = 0;
  std::uint64_t multilayer_cells = 0;
  std::uint64_t rss_bytes = 0;
  std::uint64_t compacted = 0;    // keyframes that compactions dropped
  std::uint64_t quarantined = 0;  // sessions; 0 from a daemon before 1.9
  // Of a daemon of protocol 1.9; limits of 0 are none.
  std::uint64_t used_bytes = 0;         // pages of the database
  std::uint64_t store_limit_bytes = 0;  // of those, for uploads
  std::optional<std::uint64_t> disk_free_bytes;
  std::uint64_t disk_floor_bytes = 0;  // that stay free
  std::string refusing;                // why any upload is refused now: "store_limit"; else empty
};

struct WaitSummary {
  std::uint64_t revision = 0;
  std::uint64_t dirty_tiles = 0;
};

// What is told of sessions besides: kChanges takes the daemon a look at each keyframe.
enum class SessionDetail : std::uint8_t { kUsual, kChanges };

struct SessionSummary {
  SessionKey key;
  std::string state;
  std::uint64_t keyframes = 0;
  std::uint64_t bytes = 0;
  std::int64_t first_time_ms = 0;
  std::int64_t last_time_ms = 0;
  std::uint32_t last_sequence = 0;
  std::uint64_t compacted = 0;  // keyframes that compactions dropped
  std::string reason;           // of a state that is not "live"; empty: of a daemon before 1.9, too
  bool is_damaged = false;      // `reason` says what; of a "damaged" one only the name is known
  // The last revision at which a keyframe came to it or was dropped, a pose of it was corrected, or
  // it entered another state; 0: that was not asked for, or nobody knows.
  std::uint64_t changed_revision = 0;

  // Released ones are: somebody let them in.
  bool IsInMap() const { return state == "live" || state == "released"; }
};

struct SessionChangeSummary {
  bool is_changed = false;
  std::string state;  // after it
  std::uint32_t tiles_marked = 0;
  std::uint64_t revision = 0;
  std::uint32_t sessions = 0;   // that changed; 0 from a daemon before 1.8
  std::uint64_t keyframes = 0;  // that were deleted
};

struct DigestSummary {
  Bytes sha256;
  std::uint64_t tiles = 0;
  std::uint64_t revision = 0;
};

struct CompactionSummary {
  std::uint64_t dropped = 0;        // keyframes
  std::uint64_t bytes = 0;          // of them
  std::uint64_t tiles_checked = 0;  // fused again without them
  std::uint64_t horizon = 0;        // the oldest revision that can still be read
  std::uint64_t revision = 0;
};

struct VerifySummary {
  std::uint64_t checked = 0;
  std::uint64_t damaged = 0;
  std::uint64_t mismatched = 0;
  std::vector<std::string> findings;
  std::uint64_t revision = 0;
  // Of a repair: what was found and put right, and keyframes that are gone.
  std::uint64_t restored = 0;
  std::uint64_t given_up = 0;
};

// How far a backup is.
struct BackupStage {
  bool is_copied = false;  // and is read back
  std::uint64_t done_bytes = 0;
  std::uint64_t total_bytes = 0;
};

struct BackupSummary {
  std::uint64_t bytes = 0;
  std::uint64_t revision = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t tiles = 0;
  Bytes sha256;  // of the tiles, as in a DigestSummary
};

// A file in the daemon's folder for backups.
struct BackupFile {
  std::string name;
  std::uint64_t bytes = 0;
  std::int64_t time_ms = 0;
};

// What happened to the atlas beside uploads.
struct AtlasEvent {
  std::uint64_t id = 0;
  std::uint64_t revision = 0;  // of the atlas after it
  std::int64_t time_ms = 0;
  std::string kind;
  std::string author;
  std::string subject;
  std::string detail;
  bool is_damaged = false;  // nothing but its number is known
};

}  // namespace atlas
