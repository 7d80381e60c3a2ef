// Table damaged_keyframes: those that were found and are neither healed nor given up.
#pragma once

#include <vector>

#include "core/base/status.h"
#include "server/store/damage_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

bool IsListedAsDamaged(Connection& connection, std::int64_t keyframe_id);
// In the order of their ids. kInvalidData when a row is damaged itself.
Result<std::vector<DamagedKeyframe>> ReadDamagedKeyframes(Connection& connection);

void WriteDamagedKeyframe(Connection& connection, const DamagedKeyframe& keyframe);
// False: it was not listed.
bool DeleteDamagedKeyframe(Connection& connection, std::int64_t keyframe_id);

}  // namespace atlas
