// Table pose_batches: the corrections of poses, one row a batch.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/status.h"
#include "server/store/pose_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

void WritePoseBatch(Connection& connection, const StoredBatch& batch);
// nullopt: there is none of that number. kInvalidData: its row is damaged.
Result<std::optional<StoredBatch>> ReadPoseBatch(Connection& connection, std::uint64_t id);
// kInvalidData names the first batch whose row is damaged.
Status CheckPoseBatches(Connection& connection);
// One whose number alone has a turned bit gets it back; of others nobody knows whose they were, and
// one with a number that was never given goes. How many.
int RepairPoseBatches(Connection& connection);

}  // namespace atlas
