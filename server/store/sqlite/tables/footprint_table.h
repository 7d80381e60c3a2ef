// Table keyframe_tiles: the level-0 tiles that each keyframe touches at its current pose, those
// that it touched at earlier ones, and since when.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// Reading throws what becomes kInvalidData when a row is damaged.
std::vector<TileId> ReadFootprint(Connection& connection, std::int64_t keyframe_id);
// Every tile that a row names, of now or earlier, whatever its checksum says.
std::vector<TileId> ReadFootprintUnchecked(Connection& connection, std::int64_t keyframe_id);
// The keyframes of a tile likewise.
std::vector<std::int64_t> ListKeyframesOfTile(Connection& connection, const TileId& tile);
// Makes `footprint` the current one since `revision`, whatever the rows say; damaged ones go.
void RestoreFootprint(Connection& connection,
                      std::int64_t keyframe_id,
                      std::span<const TileId> footprint,
                      std::uint64_t revision);
// Makes `footprint` the current one from `revision` on; the one before becomes a former one.
void WriteFootprint(Connection& connection,
                    std::int64_t keyframe_id,
                    std::span<const TileId> footprint,
                    std::uint64_t revision);
// The current one and all former ones.
void DeleteFootprint(Connection& connection, std::int64_t keyframe_id);
// The union of the current footprints of a session's keyframes, in key order.
std::vector<TileId> ReadSessionFootprint(Connection& connection, std::int64_t session_id);
// Of all keyframes, in key order. Damaged rows are believed, but for keys that no tile has.
std::vector<TileId> ReadAllFootprints(Connection& connection);
// The session's keyframes entered or left the map at `revision`.
void TouchSessionFootprint(Connection& connection, std::int64_t session_id, std::uint64_t revision);

// `revision`: at which the keyframe was placed last, or its session entered or left the map. Its
// tiles of now are of that revision, the former ones of earlier ones; else kInvalidData.
Status CheckFootprint(Connection& connection, std::int64_t keyframe_id, std::uint64_t revision);

struct FootprintRow {
  std::int64_t keyframe_id = 0;
  bool is_current = false;  // else the keyframe left the tile
};
// What changed in a tile after a revision, in the order of keyframe ids; after 0: everything.
std::vector<FootprintRow> FootprintsSince(Connection& connection,
                                          const TileId& tile,
                                          std::uint64_t revision);

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
