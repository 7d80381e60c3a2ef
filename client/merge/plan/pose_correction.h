// From where submaps belong to where each keyframe does.
#pragma once

#include <span>
#include <vector>

#include "client/merge/plan/merge_session.h"
#include "core/geometry/pose.h"

namespace atlas {

// By keyframe of the session, T_world_sensor; `T_world_submap` of each of its submaps, which
// BuildSubmaps filled. A keyframe moves as the submaps around it do: what odometry has drifted goes
// on smoothly along the way, so their motions are joined by a cubic through the middles of the four
// that are nearest, and go on straight before the first middle and behind the last one. Nothing
// goes on beyond a jump, and who stands moves with the submap he is in.
std::vector<Pose> CorrectedPoses(const MergeSession& session, std::span<const Pose> T_world_submap);

}  // namespace atlas
