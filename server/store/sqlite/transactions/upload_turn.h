// An upload in the order in which its vehicle sends (MissingUploads).
#pragma once

#include <functional>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"
#include "server/store/upload_room.h"

namespace atlas {

// In its turn; how it ends is noted at once, for those behind it in the same group. Where that does
// not come to the disk, it fails with all of them, and Noting() takes it back.
Result<PutKeyframeResult> PutInTurn(Connection& connection,
                                    const NewKeyframe& keyframe,
                                    UploadRoom& room);

// Notes what became of it, and of the session that it began, then calls `done`.
std::function<void(Result<PutKeyframeResult>)> Noting(
    const NewKeyframe& keyframe, std::function<void(Result<PutKeyframeResult>)> done);

}  // namespace atlas
