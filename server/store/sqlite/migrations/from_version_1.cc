#include "server/store/sqlite/migrations/from_version_1.h"

#include <cstdint>
#include <vector>

#include "core/base/integer_math.h"
#include "server/store/sqlite/tables/keyframe_table.h"
#include "server/store/sqlite/tables/pose_table.h"
#include "server/store/sqlite/tables/session_state_table.h"

namespace atlas {
namespace {

constexpr const char* kTables = R"sql(
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

DELETE FROM tiles;
UPDATE counters SET value = 0 WHERE name IN ('tiles', 'tile_bytes', 'cells', 'multilayer_cells');
)sql";

// Every session was live from its first keyframe on.
void WriteFirstStates(Connection& connection) {
  Query row = connection.Prepare(
      "SELECT s.id, s.vehicle, min(k.revision) FROM sessions s JOIN keyframes k "
      "ON k.session_id = s.id GROUP BY s.id ORDER BY s.id");
  while (row.Step()) {
    row.Rewind();
    SessionStateRow state;
    state.session_id = row.Int();
    state.author = row.Text();
    state.revision = row.Unsigned();
    WriteSessionState(connection, state);
  }
}

std::vector<std::int64_t> MovedKeyframes(Connection& connection) {
  Query row = connection.Prepare("SELECT keyframe_id FROM poses WHERE batch > 0");
  std::vector<std::int64_t> ids;
  while (row.Step()) {
    row.Rewind();
    ids.push_back(row.Int());
  }
  return ids;
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

// Where keyframes stood before they were corrected. What is damaged is passed over: whoever reads
// it is told.
void WriteFormerFootprints(Connection& connection, const MapProfile& profile) {
  const std::int64_t side_um = std::int64_t{profile.cell_size_um} * profile.tile_cells;
  for (const std::int64_t id : MovedKeyframes(connection)) {
    const auto keyframe = ReadKeyframeRow(connection, id);
    if (!keyframe) {
      continue;
    }
    const auto& grid = keyframe->record.grid;
    const std::int64_t radius_um = std::int64_t{grid.radius_cells} * grid.cell_size_um;
    for (const auto& pose : ReadPoseHistory(connection, id)) {
      if (!pose || !pose->pose.Validate().ok()) {
        continue;
      }
      for (const TileId& tile : TilesAround(pose->pose, radius_um, side_um)) {
        connection
            .Prepare("INSERT OR IGNORE INTO footprint_history (tile_key, keyframe_id) VALUES (?,?)")
            .Bind(tile.Key())
            .Bind(id)
            .Run();
      }
    }
  }
}

}  // namespace

void MigrateFromVersion1(Connection& connection, const MapProfile& profile) {
  connection.Execute(kTables);
  WriteFirstStates(connection);
  WriteFormerFootprints(connection, profile);
}

}  // namespace atlas
