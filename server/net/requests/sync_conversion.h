// Between the messages of a sync and the plan of what to send.
#pragma once

#include "proto/wire/envelope.h"
#include "proto/wire/tile_body.h"
#include "server/service/atlas_service.h"

namespace atlas {

// kInvalidArgument: an area that is none.
Result<SyncArea> AreaFromWire(const wire::Area& message, const MapProfile& profile);

// kInvalidArgument: an area that is none, a section number above 63, held tiles without hashes, a
// cursor of another request, or from before the atlas was restored.
Result<SyncRequest> SyncFromWire(const wire::SyncRequest& message, const StoreIdentity& atlas);

// The same; `message` is left with its numbers alone.
Result<SyncRequest> TakeSync(wire::SyncRequest& message, const StoreIdentity& atlas);

// To go on from: what SyncFromWire reads with a message of the same area and levels.
std::string CursorToWire(const SyncCursor& cursor,
                         const SyncRequest& request,
                         const StoreIdentity& atlas);

// That a sync takes when it is read, at most, besides its message.
struct SyncBytes {
  std::size_t request = 0;         // the area, if it is made of tiles, and what is held
  std::size_t first_manifest = 0;  // without tiles
};
SyncBytes BytesOf(const wire::SyncRequest& message);

// What became of what is held.
void HoldingsToWire(const SyncPlan& plan, wire::SyncManifest& out);
// One tile that follows.
void AnnounceTile(const TileBody& tile,
                  std::uint8_t level,
                  const MapProfile& profile,
                  wire::SyncManifest& out);

}  // namespace atlas
