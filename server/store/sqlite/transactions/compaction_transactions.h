// Dropping keyframes for good, as what happens inside a savepoint.
#pragma once

#include "core/base/status.h"
#include "server/store/compaction_types.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

// kConflict when the atlas is not at the revision that the compaction was made for.
Result<CompactionResult> CompactInStore(Connection& connection, const Compaction& compaction);

}  // namespace atlas
