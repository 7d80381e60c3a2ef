// Table damaged_keyframes: those that were found and are neither healed nor given up.
#pragma once

#include <vector>

#include "core/base/status.h"
#include "server/store/damage_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// By a row that is whole.
bool IsListedAsDamaged(Connection& connection, std::int64_t keyframe_id);
// In the order of their ids. kInvalidData when a row is damaged itself.
Result<std::vector<DamagedKeyframe>> ReadDamagedKeyframes(Connection& connection);
// kInvalidData names the first row that is damaged itself.
Status CheckDamagedKeyframes(Connection& connection);
// Of such rows nobody knows which keyframe they were of. How many.
int ForgetUnknownDamage(Connection& connection);

void WriteDamagedKeyframe(Connection& connection, const DamagedKeyframe& keyframe);
// False: it was not listed.
bool DeleteDamagedKeyframe(Connection& connection, std::int64_t keyframe_id);

}  // namespace atlas
