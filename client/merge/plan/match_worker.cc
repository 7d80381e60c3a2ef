#include "client/merge/plan/match_worker.h"

#include <algorithm>
#include <utility>

namespace atlas {

Result<SubmapWindow*> MatchWorker::Prepare(const SubmapRef& ref) {
  const auto found = std::find_if(prepared_.begin(), prepared_.end(),
                                  [&](const Prepared& one) { return one.ref == ref; });
  if (found != prepared_.end()) {
    prepared_.splice(prepared_.begin(), prepared_, found);
    return prepared_.front().window.get();
  }
  auto window = SubmapWindow::Make(At(*sessions_, ref).submap, *profile_, *options_);
  if (!window) return Error(window.error());
  prepared_.push_front({ref, std::make_unique<SubmapWindow>(*std::move(window))});
  if (prepared_.size() > kKept) prepared_.pop_back();
  return prepared_.front().window.get();
}

Result<SubmapMatch> MatchWorker::Match(const SubmapRef& a,
                                       const SubmapRef& b,
                                       const Pose& T_a_b_start) {
  const auto in_a = Prepare(a);
  if (!in_a) return Error(in_a.error());
  const auto in_b = Prepare(b);
  if (!in_b) return Error(in_b.error());
  return MatchSubmaps(**in_a, **in_b, T_a_b_start, *options_);
}

Result<SubmapMatch> MatchWorker::Search(const SubmapRef& a,
                                        const SubmapRef& b,
                                        const Pose& T_a_b_start,
                                        const SearchReach& reach) {
  const auto in_a = Prepare(a);
  if (!in_a) return Error(in_a.error());
  SubmapMatch best;
  for (const Pose& start :
       SearchSubmap(**in_a, At(*sessions_, b).submap, T_a_b_start, reach, *options_)) {
    Result<SubmapMatch> match = Match(a, b, start);
    if (!match) return match;
    if (match->explained > best.explained) best = *std::move(match);
    if (IsBelieved(best, *options_)) break;
  }
  return best;
}

}  // namespace atlas
