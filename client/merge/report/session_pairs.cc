#include "client/merge/report/session_pairs.h"

#include <cmath>
#include <map>
#include <utility>

namespace atlas {

double RootMeanSquare(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

std::vector<PairOutcome> PairsOf(const MergePlan& plan) {
  struct Found {
    std::vector<double> off_m;
    std::vector<double> off_rad;
    std::size_t rejected = 0;
  };
  std::map<std::pair<std::size_t, std::size_t>, Found> by_sessions;
  for (std::size_t i = 0; i < plan.closures.size(); ++i) {
    Found& found = by_sessions[{plan.closures[i].a.session, plan.closures[i].b.session}];
    found.off_m.push_back(plan.closure_off_m[i]);
    found.off_rad.push_back(plan.closure_off_rad[i]);
  }
  for (const RejectedClosure& one : plan.rejected_closures) {
    ++by_sessions[{one.closure.a.session, one.closure.b.session}].rejected;
  }
  std::vector<PairOutcome> pairs;
  for (const auto& [sessions, found] : by_sessions) {
    pairs.push_back({sessions.first, sessions.second, found.off_m.size(),
                     RootMeanSquare(found.off_m), RootMeanSquare(found.off_rad), found.rejected});
  }
  return pairs;
}

}  // namespace atlas
