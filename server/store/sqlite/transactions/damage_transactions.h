// Keyframes and tables that are damaged on disk: found, listed, restored where something else tells
// what they were, or given up. Each as what happens inside of a savepoint.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/base/status.h"
#include "server/store/damage_types.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// Of these, those that are damaged and cannot be restored from the atlas itself are listed, an
// event each; the others are restored. How many are listed anew.
std::uint32_t NoteDamageInStore(Connection& connection, std::span<const std::int64_t> keyframes);

// A vehicle sends a keyframe again: if what is stored of it is damaged, and what is left of it
// vouches for the upload (the hash in its row, or the bytes of its blob), it is put back. nullopt:
// nothing was to be healed. kInvalidData: nothing vouches.
Result<std::optional<PutKeyframeResult>> HealInStore(Connection& connection,
                                                     std::int64_t session_id,
                                                     const NewKeyframe& keyframe);

Result<RepairOutcome> RepairKeyframeInStore(Connection& connection, const KeyframeRepair& repair);

// How much was not as it should be.
Result<std::uint32_t> RepairTablesInStore(Connection& connection,
                                          TableRepair what,
                                          std::uint8_t levels,
                                          const std::string& author);

}  // namespace atlas
