#include "client/merge/plan/merge_graph.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace atlas {
namespace {

// Those in the map come first: whatever nothing holds is held by its first node.
std::vector<std::size_t> InOrder(const std::vector<MergeSession>& sessions) {
  std::vector<std::size_t> order(sessions.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_partition(order.begin(), order.end(),
                        [&](std::size_t session) { return !sessions[session].is_staged; });
  return order;
}

// The node of each session's first submap; the others follow.
std::vector<std::size_t> FirstNodes(const std::vector<MergeSession>& sessions) {
  std::vector<std::size_t> first(sessions.size());
  std::size_t nodes = 0;
  for (const std::size_t session : InOrder(sessions)) {
    first[session] = nodes;
    nodes += sessions[session].submaps.size();
  }
  return first;
}

// Which part of a position each of a session's counts as: as many as are within `together_s` have
// one error.
class PriorShares {
 public:
  PriorShares(const MergeSession& session, double together_s)
      : half_ms_(std::llround(0.5e3 * together_s)) {
    for (const MergeKeyframe& keyframe : session.keyframes) {
      if (keyframe.prior) times_ms_.push_back(keyframe.time_ms);
    }
    std::sort(times_ms_.begin(), times_ms_.end());
  }

  double At(std::int64_t time_ms) const {
    const auto first = std::lower_bound(times_ms_.begin(), times_ms_.end(), time_ms - half_ms_);
    const auto last = std::upper_bound(first, times_ms_.end(), time_ms + half_ms_);
    return 1.0 / static_cast<double>(last - first);
  }

 private:
  std::int64_t half_ms_;
  std::vector<std::int64_t> times_ms_;
};

// One a keyframe, and not their mean: any of them may be wrong.
void AddPriors(const MergeSession& session,
               std::size_t first_node,
               const MergeOptions& options,
               PoseGraph& graph) {
  const PriorShares shares(session, options.priors.together_s);
  for (std::size_t k = 0; k < session.submaps.size(); ++k) {
    const MergeSubmap& submap = session.submaps[k];
    const Pose T_submap_world = submap.T_world_submap.inverse();
    for (std::size_t i = submap.cut.begin; i < submap.cut.end; ++i) {
      const MergeKeyframe& keyframe = session.keyframes[i];
      if (!keyframe.prior) continue;
      GraphPrior prior;
      prior.node = first_node + k;
      prior.p_submap = T_submap_world * session.T_world_sensor[i].translation();
      prior.p_world = keyframe.prior->p_world;
      prior.sigma_m.setConstant(keyframe.prior->radius_m);
      prior.share = shares.At(keyframe.time_ms);
      graph.priors.push_back(prior);
    }
  }
}

PoseGraph MakeGraph(const MergeEvidence& evidence,
                    const SubmapPoses& start,
                    const std::vector<std::size_t>& first,
                    const MergeOptions& options) {
  PoseGraph graph;
  for (const std::size_t session : InOrder(evidence.sessions)) {
    const MergeSession& own = evidence.sessions[session];
    for (std::size_t i = 0; i < own.submaps.size(); ++i) {
      graph.nodes.push_back({start[session][i], evidence.is_held[session]});
    }
    if (evidence.uses_priors[session] && !evidence.is_held[session]) {
      AddPriors(own, first[session], options, graph);
    }
    for (const SessionLink& link : evidence.links[session]) {
      graph.edges.push_back({first[session] + link.from, first[session] + link.to, link.T_from_to,
                             link.information, link.is_matched});
    }
  }
  for (const FoundClosure& closure : evidence.closures) {
    graph.edges.push_back({first[closure.a.session] + closure.a.submap,
                           first[closure.b.session] + closure.b.submap, closure.match.T_a_b,
                           PoseInformation6::Identity(), true});
  }
  return graph;
}

}  // namespace

Result<MergedPoses> OptimizeMerge(const MergeEvidence& evidence,
                                  const SubmapPoses& start,
                                  const MergeOptions& options) {
  const std::vector<std::size_t> first = FirstNodes(evidence.sessions);
  PoseGraph graph = MakeGraph(evidence, start, first, options);
  const std::size_t links = graph.edges.size() - evidence.closures.size();
  for (std::size_t i = 0; i < evidence.closures.size(); ++i) {
    graph.edges[links + i].information = InformationOf(evidence.closures[i].match, options);
  }
  const auto solved = Optimize(graph, options.graph);
  if (!solved) return Error(solved.error());
  MergedPoses merged;
  for (std::size_t session = 0; session < evidence.sessions.size(); ++session) {
    const auto begin = solved->T_world_submap.begin() + static_cast<std::ptrdiff_t>(first[session]);
    const auto count = static_cast<std::ptrdiff_t>(evidence.sessions[session].submaps.size());
    merged.T_world_submap.emplace_back(begin, begin + count);
  }
  merged.closure_off_sigmas.assign(
      solved->edge_off_sigmas.begin() + static_cast<std::ptrdiff_t>(links),
      solved->edge_off_sigmas.end());
  merged.iterations = solved->iterations;
  return merged;
}

}  // namespace atlas
