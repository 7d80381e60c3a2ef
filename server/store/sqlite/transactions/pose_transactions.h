// Batches of corrections, and what undoes them: each as what happens inside its savepoint.
#pragma once

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// AtlasStore::UpdatePoses.
Result<PoseBatchResult> UpdatePosesInStore(Connection& connection,
                                           const StoreIdentity& identity,
                                           const PoseBatch& batch);

// A batch, and each pose as it was before it, in the order of their keys. Reads all of the history.
// kNotFound: there is no such batch, or what was before it cannot be read any more. kConflict names
// the first keyframe that was corrected since, or the first session whose state it changed and that
// is in another one since. kInvalidData names what is damaged.
Result<BatchToUndo> ReadBatchToUndo(Connection& connection, std::uint64_t batch);
// AtlasStore::UndoPoses. Errors as of ReadBatchToUndo; kConflict, too: `undo` is not all that the
// batch changed.
Result<PoseBatchResult> UndoPosesInStore(Connection& connection, const PoseUndo& undo);

}  // namespace atlas
