#include "client/merge/plan/rejected_closures.h"

#include <set>

namespace atlas {

void RejectedClosures::Note(const std::vector<FoundClosure>& found) {
  for (const FoundClosure& closure : found) {
    found_.insert_or_assign({closure.a, closure.b}, closure);
  }
}

std::vector<FoundClosure> RejectedClosures::Without(
    const std::vector<FoundClosure>& believed) const {
  std::set<std::pair<SubmapRef, SubmapRef>> pairs;
  for (const FoundClosure& closure : believed) pairs.emplace(closure.a, closure.b);
  std::vector<FoundClosure> rejected;
  for (const auto& [pair, closure] : found_) {
    if (!pairs.contains(pair)) rejected.push_back(closure);
  }
  return rejected;
}

}  // namespace atlas
