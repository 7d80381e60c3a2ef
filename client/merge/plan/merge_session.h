// What a merge knows of a session: its keyframes, and the submaps they make.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "client/merge/memory/merge_work.h"
#include "core/alignment/closure_sets.h"
#include "core/alignment/session_cut.h"
#include "core/geometry/keyframe_key.h"
#include "core/geometry/pose.h"

namespace atlas {

// A position known from elsewhere, of the sensor in the world.
struct KeyframePrior {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  double radius_m = 0.0;  // one standard deviation, in each axis, above 0
};

struct MergeKeyframe {
  std::uint32_t sequence = 0;
  std::int64_t time_ms = 0;
  QuantizedPose T_world_sensor;  // as it is stored
  std::optional<KeyframePrior> prior = std::nullopt;
  std::uint64_t blob_hash = 0;  // Hash64
};

struct MergeSubmap {
  SubmapCut cut;
  SubmapSketch sketch;                     // of the submap that MergeWork has
  Pose T_world_submap = Pose::Identity();  // as it was fused

  std::size_t middle() const { return cut.begin + (cut.end - cut.begin) / 2; }
};

struct MergeSession {
  SessionKey key;
  bool is_staged = false;
  std::vector<MergeKeyframe> keyframes;  // rising in sequence
  std::vector<Pose> T_world_sensor;      // of each, by which the submaps were fused
  std::vector<MergeSubmap> submaps;
  std::uint64_t content = 0;  // Hash64 of its keyframes and of how it is cut; with the submaps
};

// One of all submaps of all sessions.
struct SubmapRef {
  std::size_t session = 0;
  std::size_t submap = 0;

  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 sees a null pointer in <=>
  friend auto operator<=>(const SubmapRef&, const SubmapRef&) = default;
};

inline std::vector<Pose> StoredPoses(const MergeSession& session) {
  std::vector<Pose> poses;
  poses.reserve(session.keyframes.size());
  for (const MergeKeyframe& keyframe : session.keyframes) {
    poses.push_back(keyframe.T_world_sensor.ToPose());
  }
  return poses;
}

// T_world_submap where the stored pose of its middle keyframe has it.
inline Pose StoredPose(const MergeSession& session, const MergeSubmap& submap) {
  const std::size_t middle = submap.middle();
  return session.keyframes[middle].T_world_sensor.ToPose() *
         (session.T_world_sensor[middle].inverse() * submap.T_world_submap);
}

// T_world_submap by session and submap.
using SubmapPoses = std::vector<std::vector<Pose>>;

inline SubmapPoses StoredPoses(const std::vector<MergeSession>& sessions) {
  SubmapPoses stored;
  for (const MergeSession& session : sessions) {
    std::vector<Pose>& poses = stored.emplace_back();
    for (const MergeSubmap& submap : session.submaps) {
      poses.push_back(StoredPose(session, submap));
    }
  }
  return stored;
}

inline const MergeSubmap& At(const std::vector<MergeSession>& sessions, const SubmapRef& ref) {
  return sessions[ref.session].submaps[ref.submap];
}

}  // namespace atlas
