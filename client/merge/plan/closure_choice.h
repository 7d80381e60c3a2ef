// Which of the closures that were found are believed: those of two sessions that agree with each
// other, where they are enough and no other way in which the sessions might meet has as much to say
// for itself.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "client/merge/plan/closure_search.h"
#include "client/merge/plan/merge_options.h"
#include "core/alignment/closure_sets.h"

namespace atlas {

// Of two sessions, or of one with itself.
struct SessionMeeting {
  std::size_t a = 0;
  std::size_t b = 0;
  std::size_t found = 0;     // closures,
  std::size_t agreeing = 0;  // of which so many agree,
  double margin = 0.0;  // with so many times the weight of the next such set; 0: none of any weight
  bool is_believed = false;
};

struct ClosureChoice {
  std::vector<FoundClosure> believed;
  std::vector<FoundClosure> rejected;
  std::vector<SessionMeeting> meetings;  // rising, those of which anything was found
};

// Whether the two submaps of a closure are nearly where it has them, as far as that is known.
using IsAsKnown = std::function<bool(const FoundClosure&)>;

// `ways` of each session, as its own links have it. A set counts by the fewer of the two sessions'
// submaps that have a part in it: `min_closures`, or two, where all of it is as known, the sessions
// are two, and others that meet often enough lead from the one to the other. `is_as_known` may be
// empty: nothing is.
ClosureChoice ChooseClosures(const std::vector<FoundClosure>& found,
                             const std::vector<SessionWay>& ways,
                             const MergeOptions& options,
                             const IsAsKnown& is_as_known = nullptr);

}  // namespace atlas
