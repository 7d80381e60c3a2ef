#include "client/merge/plan/closure_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <tuple>

#include "client/merge/plan/parallel.h"
#include "core/alignment/place_search.h"

namespace atlas {
namespace {

// What was found in two ways is one, the likelier.
void KeepLikeliest(std::vector<FoundClosure>& closures) {
  std::stable_sort(closures.begin(), closures.end(), [](const auto& one, const auto& other) {
    return std::tie(one.a, one.b, other.match.explained) <
           std::tie(other.a, other.b, one.match.explained);
  });
  const auto last = std::unique(closures.begin(), closures.end(), [](const auto& x, const auto& y) {
    return x.a == y.a && x.b == y.b;
  });
  closures.erase(last, closures.end());
}

}  // namespace

bool IsNearlyThere(const Pose& T_a_b, const Pose& T_a_b_expected, const MergeOptions& options) {
  const double turned = Eigen::Quaterniond(T_a_b.linear())
                            .angularDistance(Eigen::Quaterniond(T_a_b_expected.linear()));
  return (T_a_b.translation() - T_a_b_expected.translation()).norm() <= options.max_surprise_m &&
         turned <= options.max_surprise_rad;
}

ClosureSearch::ClosureSearch(const std::vector<MergeSession>& sessions,
                             const std::vector<SessionWay>& ways,
                             const MergeContext& context)
    : sessions_(sessions), ways_(ways), options_(context.options), work_(context.work) {
  for (std::size_t session = 0; session < sessions.size(); ++session) {
    for (std::size_t submap = 0; submap < sessions[session].submaps.size(); ++submap) {
      all_.push_back({session, submap});
    }
  }
  for (std::size_t worker = 0; worker < options_.workers; ++worker) {
    workers_.emplace_back(sessions, context);
  }
}

Result<std::vector<FoundClosure>> ClosureSearch::SearchAnywhere(const Progress& progress) {
  std::vector<Task> tasks = LookAlike();
  for (Task& near :
       LieNear(StoredPoses(sessions_), std::vector<std::size_t>(sessions_.size(), 0),
               {options_.near_m, options_.near_height_m, 1, all_.size()}, options_.reach)) {
    // What is in the map is where it should be, or is found as others are.
    if (!sessions_[near.a.session].is_staged && !sessions_[near.b.session].is_staged) {
      near.reach.reset();
    }
    tasks.push_back(near);
  }
  DropAskedTwice(tasks);
  Result<std::vector<FoundClosure>> closures = Run(std::move(tasks), progress);
  if (!closures) return closures;
  KeepLikeliest(*closures);
  Status status = KeepSearched();
  if (!status.ok()) return Error(std::move(status));
  return closures;
}

Result<std::vector<FoundClosure>> ClosureSearch::SearchNear(const SubmapPoses& T_world_submap,
                                                            const std::vector<std::size_t>& part_of,
                                                            const std::vector<FoundClosure>& known,
                                                            const Progress& progress) {
  for (const FoundClosure& closure : known) {
    looked_at_.emplace(closure.a, closure.b);
  }
  std::vector<Task> tasks = LieNear(T_world_submap, part_of,
                                    {options_.guided_m, options_.guided_height_m,
                                     options_.guided_neighbours, options_.guided_most},
                                    std::nullopt);
  std::erase_if(tasks,
                [&](const Task& task) { return !looked_at_.emplace(task.a, task.b).second; });
  return Run(std::move(tasks), progress);
}

Result<std::vector<FoundClosure>> ClosureSearch::MatchAgain(const std::vector<FoundClosure>& known,
                                                            const SubmapPoses& T_world_submap,
                                                            const Progress& progress) {
  std::vector<Task> tasks;
  for (const FoundClosure& closure : known) {
    const Pose& a = T_world_submap[closure.a.session][closure.a.submap];
    const Pose& b = T_world_submap[closure.b.session][closure.b.submap];
    tasks.push_back({closure.a, closure.b, a.inverse() * b, std::nullopt});
  }
  return Run(std::move(tasks), progress);
}

// Neighbours in a session are linked, not closed.
bool ClosureSearch::MayMeet(const SubmapRef& a, const SubmapRef& b) const {
  if (a.session != b.session) {
    return true;
  }
  const std::vector<double>& way_m = ways_[a.session].way_m;
  return std::abs(way_m[a.submap] - way_m[b.submap]) >= options_.min_loop_m;
}

// The earlier one first.
ClosureSearch::Task ClosureSearch::TaskOf(const SubmapRef& from,
                                          const SubmapRef& to,
                                          const Pose& T_from_to,
                                          const std::optional<SearchReach>& reach) {
  return from < to ? Task{from, to, T_from_to, reach} : Task{to, from, T_from_to.inverse(), reach};
}

// A session that comes to the map looks for itself there, and nobody there for it. Two that are in
// the map and were looked for in each other before are where they are.
bool ClosureSearch::LooksFor(std::size_t session, std::size_t other) const {
  const MergeSession& own = sessions_[session];
  if (own.is_staged) return true;
  return !sessions_[other].is_staged && !work_.WereSearched(own.content, sessions_[other].content);
}

Status ClosureSearch::KeepSearched() {
  for (const MergeSession& one : sessions_) {
    for (const MergeSession& other : sessions_) {
      ATLAS_RETURN_IF_ERROR(work_.KeepSearched(one.content, other.content));
    }
  }
  return {};
}

// Of searches for one submap in another, as far around nearly the same start, the first stays.
void ClosureSearch::DropAskedTwice(std::vector<Task>& tasks) {
  std::map<std::pair<SubmapRef, SubmapRef>, std::vector<Task>> asked;
  std::erase_if(tasks, [&](const Task& task) {
    if (!task.reach) return false;
    std::vector<Task>& others = asked[{task.a, task.b}];
    const bool is_asked = std::any_of(others.begin(), others.end(), [&](const Task& other) {
      return IsSameSearch(*other.reach, other.T_a_b, *task.reach, task.T_a_b);
    });
    if (!is_asked) others.push_back(task);
    return is_asked;
  });
}

std::vector<ClosureSearch::Task> ClosureSearch::LookAlike() const {
  // A place's own profile is right within a sector and a few metres.
  const SearchReach reach{2.0, 2.0, 4.0 * std::numbers::pi / 180.0};
  std::vector<SubmapPlaces> submaps;
  for (const SubmapRef& ref : all_) {
    submaps.emplace_back(At(sessions_, ref).sketch.places);
  }
  std::vector<Task> tasks;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (all_[i].submap % options_.probe_stride != 0) continue;
    const auto may_be = [&](std::size_t other) {
      return MayMeet(all_[i], all_[other]) && LooksFor(all_[i].session, all_[other].session);
    };
    for (const SubmapCandidate& candidate :
         SearchPlaces(submaps, submaps[i], may_be, options_.places)) {
      tasks.push_back(TaskOf(all_[candidate.submap], all_[i], candidate.T_submap_searcher, reach));
    }
  }
  return tasks;
}

std::vector<ClosureSearch::Task> ClosureSearch::LieNear(
    const SubmapPoses& T_world_submap,
    const std::vector<std::size_t>& part_of,
    const Near& near,
    const std::optional<SearchReach>& reach) const {
  std::vector<Task> tasks;
  for (const SubmapRef& one : all_) {
    const Pose& here = T_world_submap[one.session][one.submap];
    std::vector<Neighbour> neighbours;
    for (std::size_t session = 0; session <= one.session; ++session) {
      if (part_of[session] != part_of[one.session]) continue;
      const auto more = NeighboursIn(session, one, T_world_submap, near);
      neighbours.insert(neighbours.end(), more.begin(), more.end());
    }
    std::sort(neighbours.begin(), neighbours.end(), [](const auto& a, const auto& b) {
      return std::tie(a.rank, a.distance_m, a.ref) < std::tie(b.rank, b.distance_m, b.ref);
    });
    neighbours.resize(std::min(neighbours.size(), near.most));
    for (const Neighbour& other : neighbours) {
      const Pose& there = T_world_submap[other.ref.session][other.ref.submap];
      tasks.push_back(TaskOf(other.ref, one, there.inverse() * here, reach));
    }
  }
  return tasks;
}

// Submaps of a session before `one` that are near it, the nearest first.
std::vector<ClosureSearch::Neighbour> ClosureSearch::NeighboursIn(std::size_t session,
                                                                  const SubmapRef& one,
                                                                  const SubmapPoses& T_world_submap,
                                                                  const Near& near) const {
  const Eigen::Vector3d here = T_world_submap[one.session][one.submap].translation();
  std::vector<Neighbour> neighbours;
  for (std::size_t i = 0; i < sessions_[session].submaps.size(); ++i) {
    const SubmapRef other{session, i};
    if (!(other < one) || !MayMeet(other, one)) continue;
    const Eigen::Vector3d away = T_world_submap[session][i].translation() - here;
    if (away.head<2>().norm() > near.distance_m || std::abs(away.z()) > near.height_m) continue;
    neighbours.push_back({0, away.norm(), other});
  }
  std::sort(neighbours.begin(), neighbours.end(), [](const auto& a, const auto& b) {
    return std::tie(a.distance_m, a.ref) < std::tie(b.distance_m, b.ref);
  });
  neighbours.resize(std::min(neighbours.size(), near.neighbours));
  for (std::size_t rank = 0; rank < neighbours.size(); ++rank) neighbours[rank].rank = rank;
  return neighbours;
}

bool ClosureSearch::IsExpected(const Task& task, const SubmapMatch& match) const {
  if (task.reach) {
    return true;  // it was looked for
  }
  return IsNearlyThere(match.T_a_b, task.T_a_b, options_);
}

// Pairs of a few submaps on end are one worker's, one submap after the other: what is prepared of
// it serves all of its pairs, and what they are matched with is nearly the same for the next.
Result<std::vector<FoundClosure>> ClosureSearch::Run(std::vector<Task> tasks,
                                                     const Progress& progress) {
  constexpr std::size_t kOnEnd = 8;
  std::stable_sort(tasks.begin(), tasks.end(), [](const Task& a, const Task& b) {
    return std::tie(a.b, a.a) < std::tie(b.b, b.a);
  });
  const auto is_together = [](const Task& a, const Task& b) {
    return a.b.session == b.b.session && a.b.submap / kOnEnd == b.b.submap / kOnEnd;
  };
  std::vector<std::size_t> begin;  // of each part of them
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (i == 0 || !is_together(tasks[i - 1], tasks[i])) begin.push_back(i);
  }
  begin.push_back(tasks.size());
  std::vector<std::optional<FoundClosure>> found(tasks.size());
  std::mutex mutex;
  std::size_t done = 0;
  const auto run = [&](std::size_t worker, std::size_t i) -> Status {
    const Task& task = tasks[i];
    const auto match = task.reach ? workers_[worker].Search(task.a, task.b, task.T_a_b, *task.reach)
                                  : workers_[worker].Match(task.a, task.b, task.T_a_b);
    if (!match) return match.error();
    if (IsBelieved(*match, options_.match) && IsExpected(task, *match)) {
      found[i] = FoundClosure{task.a, task.b, *match};
    }
    const std::lock_guard lock(mutex);
    return progress ? progress(++done, tasks.size()) : Status();
  };
  Status status = RunParallel(begin.size() - 1, workers_.size(),
                              [&](std::size_t worker, std::size_t part) -> Status {
                                for (std::size_t i = begin[part]; i < begin[part + 1]; ++i) {
                                  ATLAS_RETURN_IF_ERROR(run(worker, i));
                                }
                                return {};
                              });
  if (!status.ok()) return Error(std::move(status));
  std::vector<FoundClosure> closures;
  for (const std::optional<FoundClosure>& one : found) {
    if (one) closures.push_back(*one);
  }
  std::stable_sort(closures.begin(), closures.end(), [](const auto& a, const auto& b) {
    return std::tie(a.a, a.b) < std::tie(b.a, b.b);
  });
  return closures;
}

}  // namespace atlas
