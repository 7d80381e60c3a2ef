// From where submaps belong to where each keyframe does.
#pragma once

#include <span>
#include <vector>

#include "client/merge/plan/merge_session.h"
#include "core/geometry/pose.h"

namespace atlas {

// By keyframe of the session, T_world_sensor; `T_world_submap` of each of its submaps, which
// BuildSubmaps filled. Between the middles of two submaps a keyframe moves with both, the nearer
// one the more; before the first middle and behind the last one, and at a jump, with one.
std::vector<Pose> CorrectedPoses(const MergeSession& session, std::span<const Pose> T_world_submap);

}  // namespace atlas
