// Table keyframes, and keyframe_tiles, its index by the level-0 tiles that a keyframe touches.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// A row without its blob, checksum verified; the pose is not part of it.
struct KeyframeRow {
  KeyframeRecord record;  // the session key and the pose are left empty
  std::int64_t session_id = 0;
  std::uint64_t blob_hash = 0;
  std::uint32_t blob_bytes = 0;
};

Result<std::optional<KeyframeRow>> FindKeyframeRow(Connection& connection,
                                                   std::int64_t session_id,
                                                   std::uint32_t sequence);
// Row, session and pose. kNotFound, or kInvalidData when any of them is damaged.
Result<KeyframeRecord> ReadKeyframeRecord(Connection& connection, std::int64_t id);
Result<KeyframeRecord> FindKeyframeRecord(Connection& connection, const KeyframeKey& key);
// The blob, its hash verified.
Result<Bytes> ReadBlob(Connection& connection, std::int64_t id);

void InsertKeyframe(Connection& connection,
                    const NewKeyframe& keyframe,
                    std::int64_t id,
                    std::int64_t session_id,
                    std::uint64_t revision);

std::vector<TileId> ReadFootprint(Connection& connection, std::int64_t keyframe_id);
void WriteFootprint(Connection& connection,
                    std::int64_t keyframe_id,
                    std::span<const TileId> footprint);
std::vector<std::int64_t> KeyframesTouching(Connection& connection, const TileId& tile);

}  // namespace atlas
