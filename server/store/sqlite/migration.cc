#include "server/store/sqlite/migration.h"

#include <algorithm>
#include <vector>

#include "core/base/integer_math.h"
#include "core/base/str_cat.h"
#include "server/store/sqlite/footprint_table.h"
#include "server/store/sqlite/pose_table.h"
#include "server/store/sqlite/schema.h"
#include "server/store/sqlite/session_state_table.h"

namespace atlas {
namespace {

// Version 2: what was, for reading the atlas as of an earlier revision.
constexpr const char* kTables2 = R"sql(
CREATE TABLE session_states (
  id INTEGER PRIMARY KEY,
  session_id INTEGER NOT NULL,
  revision INTEGER NOT NULL, state INTEGER NOT NULL,
  author TEXT NOT NULL, reason TEXT NOT NULL,
  checksum INTEGER NOT NULL,
  UNIQUE (session_id, revision));

CREATE TABLE footprint_history (
  tile_key INTEGER NOT NULL, keyframe_id INTEGER NOT NULL,
  checksum INTEGER,
  PRIMARY KEY (tile_key, keyframe_id)) WITHOUT ROWID;

INSERT INTO counters (id, name, value) VALUES (11, 'history_horizon', 0);
)sql";

// Every session of version 1 was live from its first keyframe on. The order of the joins (CROSS)
// keeps it to indexes: rows of keyframes are large.
void WriteFirstStates(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT s.id, s.vehicle, min(h.revision) FROM sessions s CROSS JOIN keyframes k "
      "ON k.session_id = s.id CROSS JOIN pose_history h ON h.keyframe_id = k.id "
      "GROUP BY s.id ORDER BY s.id");
  while (row.Step()) {
    row.Rewind();
    SessionStateRow state;
    state.session_id = row.Int();
    state.author = row.Text();
    state.revision = row.Unsigned();
    WriteSessionState(connection, state);
  }
}

// What a keyframe may have at most: a damaged row must not name half the world.
constexpr std::int64_t kMaxRadius_um = 1'024'000'000;

struct Moved {
  std::int64_t keyframe_id = 0;
  std::int64_t radius_um = 0;
};

std::vector<Moved> MovedKeyframes(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT k.id, k.radius_cells * k.cell_size_um FROM poses p CROSS JOIN keyframes k "
      "ON k.id = p.keyframe_id WHERE p.batch > 0 ORDER BY k.id");
  std::vector<Moved> moved;
  while (row.Step()) {
    row.Rewind();
    Moved keyframe;
    keyframe.keyframe_id = row.Int();
    keyframe.radius_um = std::min(row.Int(), kMaxRadius_um);
    moved.push_back(keyframe);
  }
  return moved;
}

// The tiles under the square around the grid's disc: its footprint and a few more, which fusion
// finds that it does not reach.
std::vector<TileId> TilesAround(const QuantizedPose& pose,
                                std::int64_t radius_um,
                                std::int64_t side_um) {
  std::vector<TileId> tiles;
  for (std::int64_t y = FloorDiv(pose.y_um - radius_um, side_um);
       y <= FloorDiv(pose.y_um + radius_um, side_um); ++y) {
    for (std::int64_t x = FloorDiv(pose.x_um - radius_um, side_um);
         x <= FloorDiv(pose.x_um + radius_um, side_um); ++x) {
      tiles.push_back({0, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)});
    }
  }
  return tiles;
}

// Where keyframes stood before they were corrected. A damaged line of the history is passed over:
// whoever reads it is told.
void WriteFormerFootprints(Connection& connection, const MapProfile& profile) {
  const std::int64_t side_um = std::int64_t{profile.cell_size_um} * profile.tile_cells;
  for (const Moved& keyframe : MovedKeyframes(connection)) {
    for (const auto& pose : ReadPoseHistory(connection, keyframe.keyframe_id)) {
      if (pose && pose->pose.Validate().ok()) {
        AddFormerFootprint(connection, keyframe.keyframe_id,
                           TilesAround(pose->pose, keyframe.radius_um, side_um));
      }
    }
  }
}

}  // namespace

void AddTables(Connection& connection, std::int64_t from) {
  if (from < 2) {
    connection.Execute(kTables2);
  }
}

void MigrateSchema(Connection& connection, const MapProfile& profile) {
  const std::int64_t from = connection.Ask("PRAGMA user_version");
  if (from == kStoreSchemaVersion) {
    return;
  }
  connection.Execute("BEGIN IMMEDIATE");
  AddTables(connection, from);
  if (from < 2) {
    WriteFirstStates(connection);
    WriteFormerFootprints(connection, profile);
  }
  connection.Execute(StrCat("PRAGMA user_version = ", kStoreSchemaVersion, "; COMMIT;").c_str());
}

}  // namespace atlas
