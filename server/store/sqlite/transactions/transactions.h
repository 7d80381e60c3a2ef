// The writes of the store, each as what happens inside its savepoint.
#pragma once

#include <string>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"
#include "server/store/upload_room.h"

namespace atlas {

Result<PutKeyframeResult> PutKeyframeInStore(Connection& connection,
                                             const NewKeyframe& keyframe,
                                             UploadRoom& room);
// `levels` of the pyramid: the parent of a changed tile is marked if it is one of them.
Result<FinishResult> FinishTileInStore(Connection& connection,
                                       const FinishedTile& tile,
                                       std::uint8_t levels);
std::uint32_t MarkDirtyInStore(Connection& connection, const std::vector<TileId>& ids);
// In the place of marks of which some are damaged or lost: on every tile there may be. `why` is for
// people.
void MarkAllInStore(Connection& connection, const std::string& why, std::uint8_t levels);
// Goes on over a damaged mark: with marks on everything.
Result<ClaimResult> ClaimDirtyInStore(Connection& connection,
                                      const ClaimRequest& request,
                                      std::uint8_t levels);
std::uint64_t AdoptFusionRulesInStore(Connection& connection,
                                      std::uint64_t rules,
                                      std::uint8_t levels);

}  // namespace atlas
