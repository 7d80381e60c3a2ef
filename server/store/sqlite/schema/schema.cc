#include "server/store/sqlite/schema/schema.h"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema_check.h"
#include "server/store/sqlite/schema/table_sums.h"

namespace atlas {
namespace {

// Blobs stand last in their rows: the other columns are read without touching overflow pages.
constexpr const char* kTables = R"sql(
CREATE TABLE meta (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  profile BLOB NOT NULL, atlas_id BLOB NOT NULL, epoch INTEGER NOT NULL,
  checksum INTEGER NOT NULL);

CREATE TABLE counters (
  id INTEGER PRIMARY KEY, name TEXT NOT NULL, value INTEGER NOT NULL,
  checksum INTEGER NOT NULL);

CREATE TABLE sessions (
  id INTEGER PRIMARY KEY,
  vehicle TEXT NOT NULL, session TEXT NOT NULL,
  state INTEGER NOT NULL, state_reason TEXT,
  keyframes INTEGER NOT NULL, bytes INTEGER NOT NULL,
  first_time_ms INTEGER NOT NULL, last_time_ms INTEGER NOT NULL, last_sequence INTEGER NOT NULL,
  compacted INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  UNIQUE (vehicle, session));
CREATE INDEX quarantined_sessions ON sessions (id) WHERE state = 2;

CREATE TABLE keyframes (
  id INTEGER PRIMARY KEY,
  shard INTEGER NOT NULL,
  session_id INTEGER NOT NULL, sequence INTEGER NOT NULL,
  time_ms INTEGER NOT NULL, revision INTEGER NOT NULL,
  cell_size_um INTEGER NOT NULL, radius_cells INTEGER NOT NULL,
  level_qw INTEGER NOT NULL, level_qx INTEGER NOT NULL,
  level_qy INTEGER NOT NULL, level_qz INTEGER NOT NULL,
  prior_x_um INTEGER, prior_y_um INTEGER, prior_z_um INTEGER, prior_radius_mm INTEGER,
  blob_bytes INTEGER NOT NULL, blob_hash INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  blob BLOB NOT NULL,
  UNIQUE (session_id, sequence));

CREATE TABLE poses (
  keyframe_id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL, batch INTEGER NOT NULL,
  x_um INTEGER NOT NULL, y_um INTEGER NOT NULL, z_um INTEGER NOT NULL,
  qw INTEGER NOT NULL, qx INTEGER NOT NULL, qy INTEGER NOT NULL, qz INTEGER NOT NULL,
  checksum INTEGER NOT NULL);

CREATE TABLE pose_history (
  id INTEGER PRIMARY KEY,
  keyframe_id INTEGER NOT NULL,
  revision INTEGER NOT NULL, batch INTEGER NOT NULL, author TEXT NOT NULL,
  x_um INTEGER NOT NULL, y_um INTEGER NOT NULL, z_um INTEGER NOT NULL,
  qw INTEGER NOT NULL, qx INTEGER NOT NULL, qy INTEGER NOT NULL, qz INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  UNIQUE (keyframe_id, revision));

CREATE TABLE pose_batches (
  id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL, author TEXT NOT NULL, updated INTEGER NOT NULL,
  if_revision INTEGER,
  checksum INTEGER NOT NULL);

CREATE TABLE tiles (
  key INTEGER PRIMARY KEY,
  shard INTEGER NOT NULL,
  revision INTEGER NOT NULL, fused_revision INTEGER NOT NULL,
  payload_hash INTEGER NOT NULL,
  cells INTEGER NOT NULL, multilayer_cells INTEGER NOT NULL,
  blob_bytes INTEGER NOT NULL, blob_hash INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  blob BLOB NOT NULL);
CREATE INDEX tile_summaries ON tiles
  (key, revision, fused_revision, payload_hash, cells, multilayer_cells, blob_bytes, blob_hash,
   checksum);

CREATE TABLE keyframe_tiles (
  tile_key INTEGER NOT NULL, keyframe_id INTEGER NOT NULL,
  revision INTEGER NOT NULL, is_current INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  PRIMARY KEY (tile_key, keyframe_id)) WITHOUT ROWID;
CREATE INDEX tiles_of_keyframe ON keyframe_tiles (keyframe_id);
CREATE INDEX changes_of_tile ON keyframe_tiles
  (tile_key, revision, keyframe_id, is_current, checksum);

CREATE TABLE dirty_tiles (
  key INTEGER PRIMARY KEY,
  shard INTEGER NOT NULL, level INTEGER NOT NULL,
  generation INTEGER NOT NULL, since INTEGER NOT NULL,
  lease_owner TEXT, lease_until_ms INTEGER NOT NULL DEFAULT 0,
  attempts INTEGER NOT NULL DEFAULT 0, retry_at_ms INTEGER NOT NULL DEFAULT 0,
  checksum INTEGER NOT NULL);
CREATE INDEX dirty_since ON dirty_tiles (since);

CREATE TABLE session_states (
  id INTEGER PRIMARY KEY,
  session_id INTEGER NOT NULL,
  revision INTEGER NOT NULL, state INTEGER NOT NULL,
  author TEXT NOT NULL, reason TEXT NOT NULL,
  checksum INTEGER NOT NULL,
  UNIQUE (session_id, revision));

CREATE TABLE compactions (
  id INTEGER PRIMARY KEY,
  revision INTEGER NOT NULL, before_ms INTEGER NOT NULL, author TEXT NOT NULL,
  dropped INTEGER NOT NULL, bytes INTEGER NOT NULL,
  checksum INTEGER NOT NULL);

CREATE TABLE tombstones (
  session_id INTEGER NOT NULL, sequence INTEGER NOT NULL,
  time_ms INTEGER NOT NULL,
  blob_bytes INTEGER NOT NULL, blob_hash INTEGER NOT NULL,
  compaction_id INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  PRIMARY KEY (session_id, sequence)) WITHOUT ROWID;
CREATE INDEX tombstones_of_compaction ON tombstones (compaction_id);

CREATE TABLE starts (
  number INTEGER PRIMARY KEY,
  id BLOB NOT NULL, revision INTEGER NOT NULL,
  checksum INTEGER NOT NULL);

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

INSERT INTO counters (id, name, value, checksum)
  WITH names (id, name) AS (VALUES
    (1, 'revision'), (2, 'batch'), (3, 'last_keyframe_id'), (4, 'keyframes'),
    (5, 'keyframe_bytes'), (6, 'tiles'), (7, 'tile_bytes'), (8, 'cells'),
    (9, 'multilayer_cells'), (10, 'sessions'), (11, 'history_horizon'), (12, 'compactions'),
    (13, 'compacted'), (14, 'fusion_rules'), (15, 'events'))
  SELECT id, name, 0, row_hash(12, id, 0) FROM names;
)sql";

struct Index {
  std::string name;
  std::string sql;  // without the semicolon, as SQLite keeps it
};

// As the tables have them; those of keys are SQLite's own, and cannot be dropped.
std::vector<Index> ListIndexes() {
  constexpr std::string_view kCreate = "CREATE INDEX ";
  const std::string_view tables = kTables;
  std::vector<Index> indexes;
  for (std::size_t at = tables.find(kCreate); at != std::string_view::npos;
       at = tables.find(kCreate, at + 1)) {
    const std::string_view sql = tables.substr(at, tables.find(';', at) - at);
    const std::string_view name = sql.substr(kCreate.size());
    indexes.push_back({std::string(name.substr(0, name.find(' '))), std::string(sql)});
  }
  return indexes;
}

bool IsThere(Connection& connection, const Index& index) {
  Query row = connection.Prepare("SELECT 1 FROM sqlite_master WHERE type = 'index' AND name = ?");
  row.Bind(std::string_view(index.name));
  return row.Step();
}

std::int64_t MetaHash(ByteSpan profile, ByteSpan atlas_id, std::uint64_t epoch) {
  return RowHash(RowKind::kMeta).Raw(profile).Raw(atlas_id).Unsigned(epoch).value();
}

}  // namespace

void CreateTables(Connection& connection) {
  AddRowHash(connection);
  connection.Execute(kTables);
}

void CreateSchema(Connection& connection, const StoreIdentity& identity) {
  connection.Execute("PRAGMA page_size = 8192; PRAGMA journal_mode = DELETE; BEGIN IMMEDIATE;");
  CreateTables(connection);
  WriteTableSums(connection);
  const Bytes profile = identity.profile.Encode();
  connection.Prepare("INSERT INTO meta (id, profile, atlas_id, epoch, checksum) VALUES (1,?,?,?,?)")
      .Bind(ByteSpan(profile))
      .Bind(ByteSpan(identity.atlas_id))
      .Bind(identity.epoch)
      .Bind(MetaHash(profile, identity.atlas_id, identity.epoch))
      .Run();
  connection.Execute(StrCat("PRAGMA application_id = ", kStoreApplicationId,
                            "; PRAGMA user_version = ", kStoreSchemaVersion, "; COMMIT;")
                         .c_str());
}

void WriteEpoch(Connection& connection, const StoreIdentity& identity, std::uint64_t epoch) {
  const Bytes profile = identity.profile.Encode();
  connection.Prepare("UPDATE meta SET epoch = ?, checksum = ? WHERE id = 1")
      .Bind(epoch)
      .Bind(MetaHash(profile, identity.atlas_id, epoch))
      .Run();
}

Result<std::int64_t> ReadSchemaVersion(Connection& connection) {
  const std::int64_t application = connection.Ask("PRAGMA application_id");
  if (application != kStoreApplicationId) {
    return Error(StatusCode::kInvalidData,
                 StrCat("store: the database belongs to another program (application id ",
                        application, ", expected ", kStoreApplicationId, ")"));
  }
  const std::int64_t version = connection.Ask("PRAGMA user_version");
  if (version < 1 || version > kStoreSchemaVersion) {
    return Error(StatusCode::kUnsupported,
                 StrCat("store: schema version ", version, ", this build knows 1 to ",
                        kStoreSchemaVersion, "; use the version that wrote it"));
  }
  return version;
}

Result<StoreIdentity> ReadMeta(Connection& connection) {
  Query row =
      connection.Prepare("SELECT profile, atlas_id, epoch, checksum FROM meta WHERE id = 1");
  if (!row.Step()) {
    return Error(StatusCode::kInvalidData, "store: the meta row is missing");
  }
  const Bytes profile_bytes = row.Blob();
  const Bytes atlas_id = row.Blob();
  StoreIdentity identity;
  identity.epoch = row.Unsigned();
  if (atlas_id.size() != identity.atlas_id.size() ||
      !row.IsChecksum(MetaHash(profile_bytes, atlas_id, identity.epoch))) {
    return Error(StatusCode::kInvalidData, "store: the meta row is damaged");
  }
  std::copy(atlas_id.begin(), atlas_id.end(), identity.atlas_id.begin());
  auto profile = MapProfile::Decode(profile_bytes);
  if (!profile) {
    return Error(profile.error().WithContext("store"));
  }
  identity.profile = *profile;
  return identity;
}

Result<StoreIdentity> ReadIdentity(Connection& connection) {
  const Result<std::int64_t> version = ReadSchemaVersion(connection);
  if (!version) {
    return Error(version.error());
  }
  if (*version < kFirstReadableVersion) {
    return Error(
        StatusCode::kUnsupported,
        StrCat("store: schema version ", *version, ", this build reads ", kFirstReadableVersion,
               " to ", kStoreSchemaVersion, "; open it once with atlasd, which upgrades it"));
  }
  if (Status schema = CheckSchema(connection); !schema.ok()) {
    return Error(std::move(schema));
  }
  connection.TakeWholeSchemasOnly();
  return ReadMeta(connection);
}

void WriteUnchanged(Connection& connection) {
  connection.Execute(StrCat("PRAGMA user_version = ", kStoreSchemaVersion).c_str());
}

Status CheckIndexes(Connection& connection) {
  if (connection.Ask("PRAGMA user_version") != kStoreSchemaVersion) {
    return {};  // a backup of an earlier one, which had others
  }
  for (const Index& index : ListIndexes()) {
    if (!IsThere(connection, index)) {
      return Status(StatusCode::kInvalidData, StrCat("store: the index ", index.name,
                                                     " is missing; atlas verify --repair makes it "
                                                     "anew"));
    }
  }
  return {};
}

int RestoreIndexes(Connection& connection) {
  int restored = 0;
  for (const Index& index : ListIndexes()) {
    if (!IsThere(connection, index)) {
      connection.Execute(index.sql.c_str());
      ++restored;
    }
  }
  return restored;
}

}  // namespace atlas
