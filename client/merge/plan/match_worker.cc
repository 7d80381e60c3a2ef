#include "client/merge/plan/match_worker.h"

#include <algorithm>
#include <utility>

namespace atlas {

Result<MatchWorker::Prepared*> MatchWorker::Load(const SubmapName& name) {
  const auto found = std::find_if(prepared_.begin(), prepared_.end(),
                                  [&](const Prepared& one) { return one.name == name; });
  if (found != prepared_.end()) {
    prepared_.splice(prepared_.begin(), prepared_, found);
    return &prepared_.front();
  }
  Result<Submap> submap = context_.work.LoadSubmap(name);
  if (!submap) return Error(submap.error());
  prepared_.push_front({name, std::make_unique<const Submap>(*std::move(submap)), nullptr});
  if (prepared_.size() > kKept) prepared_.pop_back();
  return &prepared_.front();
}

Result<SubmapWindow*> MatchWorker::Prepare(const SubmapName& name) {
  const auto loaded = Load(name);
  if (!loaded) return Error(loaded.error());
  Prepared& prepared = **loaded;
  if (prepared.window == nullptr) {
    auto window = SubmapWindow::Make(*prepared.submap, context_.profile, context_.options.match);
    if (!window) return Error(window.error());
    prepared.window = std::make_unique<SubmapWindow>(*std::move(window));
  }
  return prepared.window.get();
}

Result<SubmapMatch> MatchWorker::MatchNow(const SubmapName& a,
                                          const SubmapName& b,
                                          const Pose& T_a_b_start) {
  const auto in_a = Prepare(a);
  if (!in_a) return Error(in_a.error());
  const auto in_b = Prepare(b);
  if (!in_b) return Error(in_b.error());
  return MatchSubmaps(**in_a, **in_b, T_a_b_start, context_.options.match);
}

Result<SubmapMatch> MatchWorker::Match(const SubmapRef& a,
                                       const SubmapRef& b,
                                       const Pose& T_a_b_start) {
  const SubmapName& in_a = NameOf(a);
  const SubmapName& in_b = NameOf(b);
  if (const auto known = context_.work.FindMatch(in_a, in_b, T_a_b_start)) return *known;
  Result<SubmapMatch> match = MatchNow(in_a, in_b, T_a_b_start);
  if (!match) return match;
  Status status = context_.work.KeepMatch({in_a, in_b, T_a_b_start, *match});
  if (!status.ok()) return Error(std::move(status));
  return match;
}

Result<SubmapMatch> MatchWorker::SearchNow(const SubmapName& a,
                                           const SubmapName& b,
                                           const Pose& T_a_b_start,
                                           const SearchReach& reach) {
  const MatchOptions& options = context_.options.match;
  const auto in_a = Prepare(a);
  if (!in_a) return Error(in_a.error());
  const auto other = Load(b);
  if (!other) return Error(other.error());
  SubmapMatch best;
  for (const Pose& start : SearchSubmap(**in_a, *(*other)->submap, T_a_b_start, reach, options)) {
    Result<SubmapMatch> match = MatchNow(a, b, start);
    if (!match) return match;
    if (match->explained > best.explained) best = *std::move(match);
    if (IsBelieved(best, options)) break;
  }
  return best;
}

Result<SubmapMatch> MatchWorker::Search(const SubmapRef& a,
                                        const SubmapRef& b,
                                        const Pose& T_a_b_start,
                                        const SearchReach& reach) {
  const SubmapName& in_a = NameOf(a);
  const SubmapName& in_b = NameOf(b);
  if (const auto known = context_.work.FindSearch(in_a.content, in_b.content, T_a_b_start, reach)) {
    return known->T_a_b ? Match(a, b, *known->T_a_b) : SubmapMatch();
  }
  Result<SubmapMatch> best = SearchNow(in_a, in_b, T_a_b_start, reach);
  if (!best) return best;
  SearchRecord record{in_a.content, in_b.content, T_a_b_start, reach, std::nullopt};
  Status status;
  if (IsBelieved(*best, context_.options.match)) {
    record.T_a_b = best->T_a_b;
    // Whoever asks again begins there.
    status = context_.work.KeepMatch({in_a, in_b, best->T_a_b, *best});
  }
  if (status.ok()) status = context_.work.KeepSearch(record);
  if (!status.ok()) return Error(std::move(status));
  return best;
}

}  // namespace atlas
