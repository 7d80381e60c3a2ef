// Tables poses, pose_history and pose_batches: where each keyframe stands now, and ever stood.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/store_types.h"

namespace atlas {

// kInvalidData when the row is missing or damaged.
Result<QuantizedPose> ReadPose(Connection& connection, std::int64_t keyframe_id);
// The pose that the keyframe had at a revision; nullopt: it was not there yet. kInvalidData when
// the line that tells is damaged.
Result<std::optional<QuantizedPose>> ReadPoseAt(Connection& connection,
                                                std::int64_t keyframe_id,
                                                std::uint64_t revision);
// The pose that the keyframe was uploaded with; nullopt: that line was damaged, and taken out.
// kInvalidData when it is damaged.
Result<std::optional<QuantizedPose>> ReadUploadedPose(Connection& connection,
                                                      std::int64_t keyframe_id);

struct PoseChange {
  std::int64_t keyframe_id = 0;
  QuantizedPose pose;
  std::uint64_t revision = 0;
  std::uint64_t batch = 0;  // 0: the pose it was uploaded with
  std::string author;
};
// Every line of a keyframe's history, oldest first; an error for each that is damaged.
std::vector<Result<PoseChange>> ReadPoseHistory(Connection& connection, std::int64_t keyframe_id);
// kInvalidData when a line of the history is damaged, or the last is not the current pose.
Status CheckPoseHistory(Connection& connection,
                        std::int64_t keyframe_id,
                        const QuantizedPose& current);

// The current pose and its line in the history.
void WritePose(Connection& connection, const PoseChange& change);

// Puts a current pose right by its line in the history, or that line by the current pose, where one
// of the two is damaged and the other tells. `author`: of a line that is written anew. False: none
// tells, or nothing is damaged.
bool RestorePose(Connection& connection, std::int64_t keyframe_id, const std::string& author);
// Takes damaged lines out of the history. How many.
int DeleteDamagedPoses(Connection& connection, std::int64_t keyframe_id);
// Of lines of the history whose checksum is wrong: the numbers of their rows.
std::vector<std::int64_t> ListDamagedPoseLines(Connection& connection);
// Whether the line of that row would be intact under another key.
bool IsPoseLineUnder(Connection& connection,
                     std::int64_t id,
                     std::int64_t keyframe_id,
                     std::int64_t revision);

// The current pose and the whole history.
void DeletePoses(Connection& connection, std::int64_t keyframe_id);

void WritePoseBatch(Connection& connection, const PoseBatch& batch, const PoseBatchResult& result);
// kInvalidData names the first batch whose row is damaged.
Status CheckPoseBatches(Connection& connection);
// One whose number alone has a turned bit gets it back; of others nobody knows whose they were, and
// one with a number that was never given goes. How many.
int RepairPoseBatches(Connection& connection);

}  // namespace atlas
