// A merge from sessions to corrected poses: links, closures, which of them to believe, all poses at
// once; then again with what lies near each other by these.
#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "client/merge/plan/closure_choice.h"
#include "client/merge/plan/merge_context.h"
#include "client/merge/plan/merge_effect.h"
#include "client/merge/plan/merge_session.h"
#include "client/merge/plan/prior_frame.h"
#include "client/merge/plan/session_links.h"
#include "client/merge/plan/submap_builder.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// A step of the work, and how much of it is done; one call at a time, from any thread. A failed
// status ends the merge.
using MergeProgress =
    std::function<Status(std::string_view step, std::size_t done, std::size_t all)>;

struct SessionOutcome {
  // It is in the map, or belongs into it now: it meets sessions that are, or where none is, most of
  // the others.
  bool is_joined = false;
  bool is_held = false;  // it is in the map, and where it should be
  // It meets them, and cannot lie where it belongs: nothing that comes later helps.
  bool is_refused = false;
  std::string why_not;  // it is not joined; for people
  std::size_t closures = 0;
  std::size_t submaps_met = 0;  // that have one, of so many:
  std::size_t submaps = 0;
  double max_move_m = 0.0;  // of its keyframes, those that move too little to be moved counted
  double rms_move_m = 0.0;
  PriorUse priors;           // the positions that are known of it
  double prior_off_m = 0.0;  // of half of them from the keyframes, at most, as they are in the end
  std::vector<MovedKeyframe> moved;  // none of a session that is not joined
};

// One that was found at some time and is not believed in the end.
struct RejectedClosure {
  FoundClosure closure;
  // Its sessions hang together, so that it is off by what is left between its submaps.
  bool is_placed = false;
  double off_m = 0.0;
  double off_rad = 0.0;
};

struct MergePlan {
  std::vector<SessionOutcome> sessions;  // as they were given
  std::vector<FoundClosure> closures;    // that are believed
  std::vector<double> closure_off_m;     // of each, what is left between the submaps
  std::vector<double> closure_off_rad;
  std::vector<SessionMeeting> meetings;
  std::size_t rejected = 0;                     // closures, each time that it was done
  int rounds = 0;                               // of the guided search
  std::vector<std::vector<SessionLink>> links;  // by session
  std::set<TileId> tiles;                       // of level 0, that would be fused again
  // Of each two submaps one, rising.
  std::vector<RejectedClosure> rejected_closures;
};

// Closures from elsewhere, which are judged with those that were found by `ways`, each time that
// these are: how a merge bears wrong ones is tried with it.
using MoreClosures = std::function<std::vector<FoundClosure>(const std::vector<FoundClosure>& found,
                                                             const std::vector<SessionWay>& ways)>;

// Fills the sessions' submaps. `readers`: of each session's blobs, one a session, which are read
// once more for each of `options.refinements`: submaps are fused again by poses that are nearly
// right, for within a submap, too, odometry drifts. `progress` may be empty.
// Errors are those of BuildSubmaps, of `progress` and of the options' Validate, kInvalidArgument
// for a prior without a radius, and kInternal where no poses are found.
Result<MergePlan> PlanMerge(std::vector<MergeSession>& sessions,
                            const std::vector<BlobReader>& readers,
                            const MergeContext& context,
                            const MergeProgress& progress,
                            const MoreClosures& more_closures = nullptr);

}  // namespace atlas
