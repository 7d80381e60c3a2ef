#include "client/merge/plan/merge_graph.h"

#include <algorithm>
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

// What its keyframes know of their place, one a submap: neighbours' errors are one error.
void AddPrior(const MergeSession& session,
              const MergeSubmap& submap,
              std::size_t node,
              PoseGraph& graph) {
  const Pose T_submap_world = submap.T_world_submap.inverse();
  GraphPrior prior;
  prior.node = node;
  double radius_m = 0.0;
  int count = 0;
  for (std::size_t i = submap.cut.begin; i < submap.cut.end; ++i) {
    const MergeKeyframe& keyframe = session.keyframes[i];
    if (!keyframe.prior) continue;
    prior.p_submap += T_submap_world * session.T_world_sensor[i].translation();
    prior.p_world += keyframe.prior->p_world;
    radius_m += keyframe.prior->radius_m;
    ++count;
  }
  if (count == 0) return;
  prior.p_submap /= count;
  prior.p_world /= count;
  prior.sigma_m.setConstant(radius_m / count);
  graph.priors.push_back(prior);
}

PoseGraph MakeGraph(const MergeEvidence& evidence,
                    const SubmapPoses& start,
                    const std::vector<std::size_t>& first) {
  PoseGraph graph;
  for (const std::size_t session : InOrder(evidence.sessions)) {
    const MergeSession& own = evidence.sessions[session];
    for (std::size_t i = 0; i < own.submaps.size(); ++i) {
      graph.nodes.push_back({start[session][i], evidence.is_held[session]});
      if (!evidence.is_held[session]) {
        AddPrior(own, own.submaps[i], first[session] + i, graph);
      }
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
  PoseGraph graph = MakeGraph(evidence, start, first);
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
