// A row of table keyframes but its blob, as it is read and as its checksum counts it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/tables/keyframe_table.h"

// As ReadFullKeyframeRow has them, behind id, session_id and sequence: statements are kept by the
// address of a literal.
#define KEYFRAME_COLUMNS_BEHIND_ITS_KEY                                                       \
  "time_ms, cell_size_um, radius_cells, level_qw, level_qx, level_qy, level_qz, blob_bytes, " \
  "blob_hash, shard, revision, prior_x_um IS NOT NULL, coalesce(prior_x_um, 0), "             \
  "coalesce(prior_y_um, 0), coalesce(prior_z_um, 0), coalesce(prior_radius_mm, 0), checksum"
#define KEYFRAME_COLUMNS "id, session_id, sequence, " KEYFRAME_COLUMNS_BEHIND_ITS_KEY

namespace atlas {

// Everything in the row but the blob, which has a hash of its own.
struct FullKeyframeRow {
  KeyframeRow row;
  std::int64_t shard = 0;
  std::uint64_t revision = 0;
  std::optional<PositionPrior> prior = {};
};

std::int64_t HashOf(const FullKeyframeRow& row);
// Columns: KEYFRAME_COLUMNS. kInvalidData: its checksum is wrong.
Result<FullKeyframeRow> ReadFullKeyframeRow(Query& query);

// kInvalidData, too: there is none of that id.
Result<FullKeyframeRow> ReadFullKeyframeRow(Connection& connection, std::int64_t id);

// Of rows whose checksum is wrong: their ids.
std::vector<std::int64_t> ListDamagedKeyframeRows(Connection& connection);
// Of all rows, in the order in which they lie: their ids, as their checksums have them where one
// bit turned.
std::vector<std::int64_t> TellKeyframeNumbers(Connection& connection);
// Whether the row would be intact under another key.
bool IsKeyframeRowUnder(Connection& connection,
                        std::int64_t id,
                        std::int64_t session_id,
                        std::int64_t sequence);
// The same of another id.
bool IsKeyframeRowOf(Connection& connection, std::int64_t id, std::int64_t other);
// As it was uploaded, but for the name of its session, its pose and its tiles. kInvalidData: its
// row or its blob is damaged.
Result<NewKeyframe> ReadUploadedKeyframe(Connection& connection, std::int64_t id);
// To another session.
Status MoveKeyframeRow(Connection& connection, std::int64_t id, std::int64_t session_id);

}  // namespace atlas
