// Tables poses and pose_history: where each keyframe stands now, and ever stood.
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
// The current pose, and what made it so; its author is left empty. kInvalidData as ReadPose.
Result<PoseChange> ReadPoseChange(Connection& connection, std::int64_t keyframe_id);
// The same of a revision, with its author; nullopt and kInvalidData as ReadPoseAt.
Result<std::optional<PoseChange>> ReadPoseChangeAt(Connection& connection,
                                                   std::int64_t keyframe_id,
                                                   std::uint64_t revision);
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

// Of a session's keyframes, as their rows say it, damaged or not: one look at the pose of each.
struct KeyframePlacing {
  std::uint32_t sequence = 0;
  std::uint64_t revision = 0;  // at which it was placed last
  std::uint64_t batch = 0;     // 0: by its upload
};
// The first one that was placed after a revision; nullopt: all stand where they stood then.
std::optional<KeyframePlacing> FindPlacedAfter(Connection& connection,
                                               std::int64_t session_id,
                                               std::uint64_t revision);
// The revision at which one was placed last; 0: there are none.
std::uint64_t LastPlacing(Connection& connection, std::int64_t session_id);
// The keyframes that a batch moved and that are still there, by their ids: reads all of the
// history. A damaged line is believed: whoever reads it finds out.
std::vector<std::int64_t> ListKeyframesOfBatch(Connection& connection, std::uint64_t batch);

}  // namespace atlas
