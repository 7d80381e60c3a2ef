// Where submaps of different sessions, or of different visits of one, show the same place.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "client/merge/plan/match_worker.h"
#include "client/merge/plan/merge_context.h"
#include "client/merge/plan/merge_session.h"
#include "core/alignment/closure_sets.h"
#include "core/base/status.h"

namespace atlas {

// `a` is of an earlier session than `b`, or of the same one and earlier in it.
struct FoundClosure {
  SubmapRef a;
  SubmapRef b;
  SubmapMatch match;
};

// Within `max_surprise_m` and `max_surprise_rad`.
bool IsNearlyThere(const Pose& T_a_b, const Pose& T_a_b_expected, const MergeOptions& options);

// Its calls return closures that are believed one by one, rising, each pair once. Errors are those
// of the work and of `progress`, which may be empty.
class ClosureSearch {
 public:
  // Of pairs; one call at a time, from any of the worker threads.
  using Progress = std::function<Status(std::size_t done, std::size_t all)>;

  // `sessions` and `ways` (of each session) outlive it.
  ClosureSearch(const std::vector<MergeSession>& sessions,
                const std::vector<SessionWay>& ways,
                const MergeContext& context);

  // By what places look like, and by where the stored poses have them, in frames that may have
  // nothing to do with each other.
  Result<std::vector<FoundClosure>> SearchAnywhere(const Progress& progress);
  // By poses that are nearly right, one a submap of each session; between sessions of one part
  // (`part_of` each). Pairs that are `known` are left out, and those that it looked at before.
  Result<std::vector<FoundClosure>> SearchNear(const SubmapPoses& T_world_submap,
                                               const std::vector<std::size_t>& part_of,
                                               const std::vector<FoundClosure>& known,
                                               const Progress& progress);

  // What is known, from where it is thought to be; what is not found there is left out.
  Result<std::vector<FoundClosure>> MatchAgain(const std::vector<FoundClosure>& known,
                                               const SubmapPoses& T_world_submap,
                                               const Progress& progress);

 private:
  struct Task {
    SubmapRef a;
    SubmapRef b;
    Pose T_a_b = Pose::Identity();
    std::optional<SearchReach> reach;  // none: it is there or not
  };
  struct Near {
    double distance_m;
    double height_m;
    std::size_t neighbours;  // of each session,
    std::size_t most;        // of all
  };

  struct Neighbour {
    std::size_t rank;  // in its session
    double distance_m;
    SubmapRef ref;
  };

  bool MayMeet(const SubmapRef& a, const SubmapRef& b) const;
  static Task TaskOf(const SubmapRef& from,
                     const SubmapRef& to,
                     const Pose& T_from_to,
                     const std::optional<SearchReach>& reach);
  bool LooksFor(std::size_t session, std::size_t other) const;
  Status KeepSearched();
  static void DropAskedTwice(std::vector<Task>& tasks);
  std::vector<Task> LookAlike() const;
  std::vector<Neighbour> NeighboursIn(std::size_t session,
                                      const SubmapRef& one,
                                      const SubmapPoses& T_world_submap,
                                      const Near& near) const;
  std::vector<Task> LieNear(const SubmapPoses& T_world_submap,
                            const std::vector<std::size_t>& part_of,
                            const Near& near,
                            const std::optional<SearchReach>& reach) const;
  Result<std::vector<FoundClosure>> Run(std::vector<Task> tasks, const Progress& progress);
  bool IsExpected(const Task& task, const SubmapMatch& match) const;

  const std::vector<MergeSession>& sessions_;
  const std::vector<SessionWay>& ways_;
  const MergeOptions& options_;
  MergeWork& work_;
  std::vector<SubmapRef> all_;
  std::vector<MatchWorker> workers_;
  std::set<std::pair<SubmapRef, SubmapRef>> looked_at_;  // by SearchNear
};

}  // namespace atlas
