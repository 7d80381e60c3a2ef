// The writes of the store, each as what happens inside its savepoint.
#pragma once

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

Result<PutKeyframeResult> PutKeyframeInStore(Connection& connection, const NewKeyframe& keyframe);
Result<PoseBatchResult> UpdatePosesInStore(Connection& connection, const PoseBatch& batch);
// `levels` of the pyramid: the parent of a changed tile is marked if it is one of them.
Result<FinishResult> FinishTileInStore(Connection& connection,
                                       const FinishedTile& tile,
                                       std::uint8_t levels);
std::uint32_t MarkDirtyInStore(Connection& connection, const std::vector<TileId>& ids);
std::uint64_t AdoptFusionRulesInStore(Connection& connection,
                                      std::uint64_t rules,
                                      std::uint8_t levels);

}  // namespace atlas
