// What a merge found and does not believe in the end: closures that others contradict, or that are
// too few.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "client/merge/plan/closure_search.h"

namespace atlas {

class RejectedClosures {
 public:
  // All that are judged; of two submaps that were found in each other before, the later.
  void Note(const std::vector<FoundClosure>& found);

  // Those that were noted, each pair of submaps once, but for pairs that are believed; rising.
  std::vector<FoundClosure> Without(const std::vector<FoundClosure>& believed) const;

 private:
  std::map<std::pair<SubmapRef, SubmapRef>, FoundClosure> found_;
};

}  // namespace atlas
