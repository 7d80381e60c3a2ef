// Keyframes of a session read back with their blobs, within one snapshot.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/status.h"
#include "server/store/keyframe_content.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// AtlasStore::ReadKeyframes. kInvalidData, too: the session's row or the index of its keyframes is
// damaged.
Result<KeyframeContents> ReadKeyframeContents(Connection& connection,
                                              const SessionKey& session,
                                              std::optional<std::uint32_t> after_sequence,
                                              std::size_t max_bytes);

}  // namespace atlas
