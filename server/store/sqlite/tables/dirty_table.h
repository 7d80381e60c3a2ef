// Table dirty_tiles: what has to be built, who is building it, and since when it is owed.
#pragma once

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// From now on this connection marks tiles before it commits, each once: uploads mark the same ones
// again and again. Everything below knows of them before that.
void MarkAtTheEnd(Connection& connection);

// `generation`: the revision of the change that marks; `since`: the first revision that the tile
// will not reflect until it is built.
void MarkTile(Connection& connection,
              const TileId& id,
              std::uint64_t generation,
              std::uint64_t since);

// kInvalidData when a mark that would be claimed is damaged.
Result<ClaimResult> ClaimTiles(Connection& connection, const ClaimRequest& request);
// kConflict when the claim is no longer held.
Status CheckClaim(Connection& connection, const TileClaim& claim);
// Clears the mark if nothing marked the tile since it was claimed; else gives the lease back.
void SettleClaim(Connection& connection, const TileClaim& claim);
// Gives the lease back. A tile that was marked again since it was claimed is free at once.
void PostponeClaim(Connection& connection, const TileClaim& claim, std::int64_t retry_at_ms);
// Leases of a process that is gone.
void DropAllLeases(Connection& connection);

// Reads all of them. kInvalidData when one is damaged or lost.
Status CheckMarks(Connection& connection);
// All, damaged ones too.
void ForgetMarks(Connection& connection);

DirtyState ReadDirty(Connection& connection);

}  // namespace atlas
