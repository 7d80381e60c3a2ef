// A merge from a source to one batch of corrections, and that batch to a daemon.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "client/connection/atlas_client.h"
#include "client/merge/memory/merge_work.h"
#include "client/merge/plan/merge_options.h"
#include "client/merge/plan/merge_planner.h"
#include "client/merge/report/merge_picture.h"
#include "client/merge/source/keyframe_spool.h"
#include "client/merge/source/session_selection.h"
#include "client/merge/source/session_source.h"
#include "core/base/status.h"

namespace atlas {

struct MergeRun {
  std::vector<MergeSession> sessions;  // what was merged
  MergePlan plan;                      // its sessions are these
  std::vector<LeftOut> left_out;
  // Of the source, when it was read: that of a daemon is the condition for what is applied.
  std::uint64_t revision = 0;
  MapProfile profile;
  // Of each session's blobs, which are in the spool.
  std::vector<BlobReader> readers;
  std::shared_ptr<KeyframeSpool> spool;

  // Where keyframes belong, and the staged sessions that come into the map with them.
  std::vector<PoseCorrection> Corrections() const;
  std::vector<SessionKey> Published() const;
  bool IsNothing() const { return Corrections().empty() && Published().empty(); }

  // T_world_sensor of each keyframe of a session.
  std::vector<Pose> PosesAfter(std::size_t session) const;

  MergePicture Picture() const;
};

// A session that was asked for and is not in the map after the merge.
struct UnmergedSession {
  SessionKey key;
  std::string why;
  bool is_waiting = false;  // nothing is wrong with it: it meets nobody yet
};

// Those of `wanted`, in their order.
std::vector<UnmergedSession> UnmergedOf(const MergeRun& run, const std::vector<SessionKey>& wanted);

// `wanted` as for ReadForMerge. Errors are those of ReadForMerge and PlanMerge.
Result<MergeRun> RunMerge(SessionSource& source,
                          const std::vector<SessionKey>& wanted,
                          const MergeOptions& options,
                          MergeWork& work,
                          const MergeProgress& progress,
                          const MoreClosures& more_closures = nullptr);

// One step of the daemon's, all or nothing. kConflict: a session of the merge is not what it was
// when it was read; nothing was changed, and the merge is to be computed again. Else as
// AtlasClient::UpdatePoses.
Result<PoseBatchSummary> ApplyMerge(const MergeRun& run,
                                    AtlasClient& client,
                                    const std::string& author);

}  // namespace atlas
