// How the submaps of a session follow each other: as its poses have it, and as its submaps fit onto
// each other.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "client/merge/graph/pose_graph.h"
#include "client/merge/plan/merge_context.h"
#include "client/merge/plan/merge_options.h"
#include "client/merge/plan/merge_session.h"
#include "core/base/status.h"

namespace atlas {

// From one submap of a session to a later one.
struct SessionLink {
  std::size_t from = 0;
  std::size_t to = 0;
  Pose T_from_to = Pose::Identity();
  PoseInformation6 information = PoseInformation6::Zero();  // as GraphEdge's
  bool is_matched = false;                                  // else as the poses have it
};

// What a match says, in 1/m^2 and 1/rad^2 as SubmapMatch has it, its features' dependence and the
// map's own error considered: positive definite.
PoseInformation6 InformationOf(const SubmapMatch& match, const MergeOptions& options);

// Of each session: from each submap to the next by the stored poses, and again by a match that
// begins at `T_world_submap`, where its submaps are thought to be, if that is believed and near
// what the stored poses say; those count as a share then. None over a jump. `progress`, if there
// is one, is told of submaps that are done, one thread at a time, and ends it with an error; else
// errors are those of the submaps' tiles.
Result<std::vector<std::vector<SessionLink>>> LinkSessions(
    const std::vector<MergeSession>& sessions,
    const SubmapPoses& T_world_submap,
    const MergeContext& context,
    const std::function<Status(std::size_t done, std::size_t all)>& progress = nullptr);

// The session by its links alone, from its first submap on; after a jump by its poses.
SessionWay WayOf(const MergeSession& session, const std::vector<SessionLink>& links);

}  // namespace atlas
