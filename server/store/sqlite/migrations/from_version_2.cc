#include "server/store/sqlite/migrations/from_version_2.h"

namespace atlas {

void MigrateFromVersion2(Connection& connection) {
  connection.Execute(R"sql(
ALTER TABLE keyframe_tiles RENAME TO earlier_keyframe_tiles;
DROP INDEX tiles_of_keyframe;

CREATE TABLE keyframe_tiles (
  tile_key INTEGER NOT NULL, keyframe_id INTEGER NOT NULL,
  revision INTEGER NOT NULL, is_current INTEGER NOT NULL,
  checksum INTEGER,
  PRIMARY KEY (tile_key, keyframe_id)) WITHOUT ROWID;
CREATE INDEX tiles_of_keyframe ON keyframe_tiles (keyframe_id);
CREATE INDEX changes_of_tile ON keyframe_tiles (tile_key, revision, keyframe_id, is_current);

INSERT INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current)
  SELECT tile_key, keyframe_id, max(
    coalesce((SELECT max(h.revision) FROM pose_history h
              WHERE h.keyframe_id = t.keyframe_id), 0),
    coalesce((SELECT max(s.revision) FROM keyframes k
              JOIN session_states s ON s.session_id = k.session_id
              WHERE k.id = t.keyframe_id), 0)), 1
  FROM earlier_keyframe_tiles t;
INSERT OR IGNORE INTO keyframe_tiles (tile_key, keyframe_id, revision, is_current)
  SELECT tile_key, keyframe_id,
    coalesce((SELECT max(h.revision) FROM pose_history h
              WHERE h.keyframe_id = f.keyframe_id), 0), 0
  FROM footprint_history f;

DROP TABLE earlier_keyframe_tiles;
DROP TABLE footprint_history;
)sql");
}

}  // namespace atlas
