// Table tiles: the blobs that workers made, their revisions, and what they hold in numbers.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// nullopt: no such tile. kInvalidData: the row or its blob is damaged, or the row is not found
// where the index says that it is.
Result<std::optional<StoredTile>> ReadTileRow(Connection& connection, const TileId& id);

// Makes the table hold `content` for `id`; none: no row. True when that was a change: then the row
// has a revision of its own, NextRevision().
bool StoreTile(Connection& connection,
               const TileId& id,
               const std::optional<TileContent>& content,
               std::uint64_t fused_revision);

// Rows that are not found and that the index lists, so that whoever makes the index anew does not
// forget them: they are damaged from then on. How many.
std::uint32_t PutBackLostTiles(Connection& connection);
// Damaged rows become again what the index has of them; SQLite is to be told not to mind what else
// it has. How many.
std::uint32_t RestoreTileRows(Connection& connection);

void ScanTileRows(Connection& connection,
                  const TileRect& rect,
                  const std::function<void(const TileSummary&)>& visit);
// Of a block of tiles (tile_block.h), in key order.
std::vector<TileSummary> ReadTileBlockRows(Connection& connection, std::uint64_t block);
std::vector<TileSummary> ListTileRows(Connection& connection,
                                      std::int64_t after_key,
                                      std::uint32_t limit);

}  // namespace atlas
