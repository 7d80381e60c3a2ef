// Of a merge, what came of each two sessions that were found in each other.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "client/merge/plan/merge_planner.h"

namespace atlas {

// Of two sessions, or of two visits of one.
struct PairOutcome {
  std::size_t a = 0;  // of the plan's sessions
  std::size_t b = 0;
  std::size_t closures = 0;  // that are believed,
  double off_m = 0.0;        // and by what they are off, root mean square
  double off_rad = 0.0;
  std::size_t rejected = 0;  // that were found and are not
};

// Rising, those of which anything was found.
std::vector<PairOutcome> PairsOf(const MergePlan& plan);

// 0 of none.
double RootMeanSquare(std::span<const double> values);

}  // namespace atlas
