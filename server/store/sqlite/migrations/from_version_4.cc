#include "server/store/sqlite/migrations/from_version_4.h"

#include <cstdint>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"

namespace atlas {
namespace {

constexpr const char* kTables = R"sql(
ALTER TABLE counters RENAME TO earlier_counters;
CREATE TABLE counters (
  id INTEGER PRIMARY KEY, name TEXT NOT NULL, value INTEGER NOT NULL,
  checksum INTEGER NOT NULL);
INSERT INTO counters (id, name, value, checksum)
  WITH names (id, name) AS (VALUES
    (1, 'revision'), (2, 'batch'), (3, 'last_keyframe_id'), (4, 'keyframes'),
    (5, 'keyframe_bytes'), (6, 'tiles'), (7, 'tile_bytes'), (8, 'cells'),
    (9, 'multilayer_cells'), (10, 'sessions'), (11, 'history_horizon'), (12, 'compactions'),
    (13, 'compacted'), (14, 'fusion_rules'), (15, 'events'))
  SELECT n.id, n.name, coalesce(e.value, 0), row_hash(12, n.id, coalesce(e.value, 0))
  FROM names n LEFT JOIN earlier_counters e ON e.id = n.id;
DROP TABLE earlier_counters;

ALTER TABLE keyframe_tiles RENAME TO earlier_keyframe_tiles;
DROP INDEX tiles_of_keyframe;
DROP INDEX changes_of_tile;
CREATE TABLE keyframe_tiles (
  tile_key INTEGER NOT NULL, keyframe_id INTEGER NOT NULL,
  revision INTEGER NOT NULL, is_current INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  PRIMARY KEY (tile_key, keyframe_id)) WITHOUT ROWID;
CREATE INDEX tiles_of_keyframe ON keyframe_tiles (keyframe_id);
CREATE INDEX changes_of_tile ON keyframe_tiles
  (tile_key, revision, keyframe_id, is_current, checksum);
INSERT INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current, checksum)
  SELECT tile_key, keyframe_id, revision, is_current,
    row_hash(13, tile_key, keyframe_id, revision, is_current)
  FROM earlier_keyframe_tiles;
DROP TABLE earlier_keyframe_tiles;

ALTER TABLE dirty_tiles RENAME TO earlier_dirty_tiles;
DROP INDEX dirty_since;
CREATE TABLE dirty_tiles (
  key INTEGER PRIMARY KEY,
  shard INTEGER NOT NULL, level INTEGER NOT NULL,
  generation INTEGER NOT NULL, since INTEGER NOT NULL,
  lease_owner TEXT, lease_until_ms INTEGER NOT NULL DEFAULT 0,
  attempts INTEGER NOT NULL DEFAULT 0, retry_at_ms INTEGER NOT NULL DEFAULT 0,
  checksum INTEGER NOT NULL);
CREATE INDEX dirty_since ON dirty_tiles (since);
INSERT INTO dirty_tiles (key, shard, level, generation, since, checksum)
  SELECT key, shard, level, generation, since, row_hash(14, key, generation, since)
  FROM earlier_dirty_tiles;
DROP TABLE earlier_dirty_tiles;

DROP INDEX tile_summaries;
CREATE INDEX tile_summaries ON tiles
  (key, revision, fused_revision, payload_hash, cells, multilayer_cells, blob_bytes, blob_hash,
   checksum);

CREATE TABLE damaged_keyframes (
  keyframe_id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL, time_ms INTEGER NOT NULL, reason TEXT NOT NULL,
  checksum INTEGER NOT NULL);

CREATE TABLE events (
  id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL, time_ms INTEGER NOT NULL,
  kind INTEGER NOT NULL, author TEXT NOT NULL, subject TEXT NOT NULL, detail TEXT NOT NULL,
  checksum INTEGER NOT NULL);

CREATE TABLE table_sums (
  id INTEGER PRIMARY KEY, name TEXT NOT NULL,
  row_count INTEGER NOT NULL, checksums INTEGER NOT NULL);
)sql";

struct Recount {
  Counter counter;
  const char* what;
  const char* sql;
  bool is_least = false;  // the counter may be higher: of what is gone no row tells
};

// An id is not given twice, and the number of sessions gives theirs: it is the highest. Sums leave
// out what no blob and no tile has: damaged rows must not overflow them.
constexpr Recount kRecounts[] = {
    {Counter::kRevision, "revisions",
     "SELECT max((SELECT coalesce(max(revision), 0) FROM pose_history), "
     "(SELECT coalesce(max(revision), 0) FROM session_states), "
     "(SELECT coalesce(max(revision), 0) FROM tiles), "
     "(SELECT coalesce(max(generation), 0) FROM dirty_tiles), "
     "(SELECT coalesce(max(revision), 0) FROM compactions))",
     true},
    {Counter::kBatch, "pose batches", "SELECT coalesce(max(id), 0) FROM pose_batches", true},
    {Counter::kLastKeyframeId, "ids of keyframes", "SELECT coalesce(max(id), 0) FROM keyframes",
     true},
    {Counter::kKeyframes, "keyframes", "SELECT count(*) FROM keyframes"},
    {Counter::kKeyframeBytes, "bytes of keyframes",
     "SELECT coalesce(sum(blob_bytes & 0xFFFFFFFF), 0) FROM keyframes"},
    {Counter::kTiles, "tiles", "SELECT count(*) FROM tiles"},
    {Counter::kTileBytes, "bytes of tiles",
     "SELECT coalesce(sum(blob_bytes & 0xFFFFFFFF), 0) FROM tiles"},
    {Counter::kCells, "cells",
     "SELECT coalesce(sum(cells & 0xFFFFFFFF), 0) FROM tiles WHERE key < 1 << 58"},
    {Counter::kMultilayerCells, "cells with layers",
     "SELECT coalesce(sum(multilayer_cells & 0xFFFFFFFF), 0) FROM tiles WHERE key < 1 << 58"},
    {Counter::kSessions, "sessions", "SELECT coalesce(max(id), 0) FROM sessions"},
    {Counter::kHistoryHorizon, "as the oldest revision that is kept",
     "SELECT coalesce(max(revision), 0) FROM compactions"},
    {Counter::kCompactions, "compactions", "SELECT count(*) FROM compactions"},
    {Counter::kCompacted, "keyframes that were dropped", "SELECT count(*) FROM tombstones"},
};

// What is said of a counter that was another.
std::string CountAgain(Connection& connection, const Recount& recount) {
  const auto found = static_cast<std::uint64_t>(connection.Ask(recount.sql));
  const std::uint64_t counted = ReadCounter(connection, recount.counter);
  if (counted == found || (recount.is_least && counted > found)) {
    return {};
  }
  SetCounter(connection, recount.counter, found);
  return StrCat("; it counted ", counted, " ", recount.what, ", and the rows say ", found);
}

// No version up to this one deleted sessions.
std::string MissSessions(Connection& connection) {
  const std::int64_t lost = connection.Ask("SELECT coalesce(max(id), 0) - count(*) FROM sessions");
  return lost == 0 ? std::string() : StrCat("; rows of ", lost, " sessions are lost");
}

}  // namespace

std::string MigrateFromVersion4(Connection& connection) {
  connection.Execute(kTables);
  std::string noticed;
  for (const Recount& recount : kRecounts) {
    noticed += CountAgain(connection, recount);
  }
  return noticed + MissSessions(connection);
}

}  // namespace atlas
