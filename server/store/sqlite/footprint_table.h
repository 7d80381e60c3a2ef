// Tables keyframe_tiles and footprint_history: the level-0 tiles that each keyframe touches at its
// current pose, and those that it touched at earlier ones.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection.h"
#include "server/store/store_types.h"

namespace atlas {

std::vector<TileId> ReadFootprint(Connection& connection, std::int64_t keyframe_id);
// Makes `footprint` the current one; the one before goes into the history.
void WriteFootprint(Connection& connection,
                    std::int64_t keyframe_id,
                    std::span<const TileId> footprint);
void AddFormerFootprint(Connection& connection,
                        std::int64_t keyframe_id,
                        std::span<const TileId> footprint);
// The union of the current footprints of a session's keyframes, in key order.
std::vector<TileId> ReadSessionFootprint(Connection& connection, std::int64_t session_id);

// By id.
std::vector<std::int64_t> KeyframesTouching(Connection& connection, const TileId& tile);
std::vector<std::int64_t> KeyframesEverTouching(Connection& connection, const TileId& tile);

// Tiles of any level over footprints, current or former: AtlasStore::ListFootprintTiles and
// ScanFootprintTiles. One look into each index a tile, however many keyframes touch it.
// kInvalidData on a key that no tile has.
Result<std::vector<TileId>> ListFootprintRows(Connection& connection,
                                              std::uint8_t level,
                                              std::int64_t after_key,
                                              std::uint32_t limit);
Status ScanFootprintRows(Connection& connection,
                         const TileRect& rect,
                         const std::function<void(const TileId&)>& visit);

}  // namespace atlas
