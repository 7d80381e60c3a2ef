// Between the messages of a sync and the plan of what to send.
#pragma once

#include "proto/wire/envelope.h"
#include "proto/wire/tile_body.h"
#include "server/service/atlas_service.h"

namespace atlas {

// kInvalidArgument: an area that is none.
Result<SyncArea> AreaFromWire(const wire::Area& message, const MapProfile& profile);

// kInvalidArgument: an area that is none, a section number above 63, held tiles without hashes, a
// cursor of another request.
Result<SyncRequest> SyncFromWire(const wire::SyncRequest& message, const MapProfile& profile);

// To go on from: what SyncFromWire reads with the same message.
std::string CursorToWire(const SyncCursor& cursor, const wire::SyncRequest& message);

// What became of what is held.
void HoldingsToWire(const SyncPlan& plan, wire::SyncManifest& out);
// One tile that follows.
void AnnounceTile(const TileBody& tile,
                  std::uint8_t level,
                  const MapProfile& profile,
                  wire::SyncManifest& out);

}  // namespace atlas
