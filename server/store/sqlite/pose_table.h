// Tables poses, pose_history and pose_batches: where each keyframe stands now, and ever stood.
#pragma once

#include <string_view>

#include "core/base/status.h"
#include "server/store/sqlite/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// kInvalidData when the row is missing or damaged.
Result<QuantizedPose> ReadPose(Connection& connection, std::int64_t keyframe_id);

struct PoseChange {
  std::int64_t keyframe_id = 0;
  QuantizedPose pose;
  std::uint64_t revision = 0;
  std::uint64_t batch = 0;  // 0: the pose it was uploaded with
  std::string_view author;
};
// The current pose and its line in the history.
void WritePose(Connection& connection, const PoseChange& change);

void WritePoseBatch(Connection& connection, const PoseBatch& batch, const PoseBatchResult& result);

}  // namespace atlas
