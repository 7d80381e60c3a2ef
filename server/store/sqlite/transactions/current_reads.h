// Reading the store as it is now.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// One for each key, in their order.
Result<FoundKeyframes> FindKeyframeRecords(Connection& connection,
                                           std::span<const KeyframeKey> keys);
// nullopt: unknown.
Result<std::optional<SessionRecord>> FindSessionRecord(Connection& connection,
                                                       const SessionKey& key);
// As AtlasStore::ListKeyframes.
Result<KeyframePage> ReadKeyframePage(Connection& connection,
                                      const SessionKey& session,
                                      std::optional<std::uint32_t> after_sequence,
                                      std::uint32_t limit);
// In ascending order, beginning behind `after_id`.
std::vector<std::int64_t> ListKeyframeRows(Connection& connection,
                                           std::int64_t after_id,
                                           std::uint32_t limit);
// As AtlasStore::ReadKeyframe.
Result<StoredKeyframe> VerifyStoredKeyframe(Connection& connection, std::int64_t id);
// What changed in the tile after the revision `since`; all of it if history does not reach as far.
Result<TileSources> GatherTileSources(Connection& connection,
                                      const TileId& id,
                                      std::uint64_t since);
// But for the bytes on disk.
StoreCounts ReadStoreCounts(Connection& connection);

}  // namespace atlas
