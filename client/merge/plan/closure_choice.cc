#include "client/merge/plan/closure_choice.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace atlas {
namespace {

// Submaps of each session that have a part in it.
std::size_t CountPlaces(const std::vector<Closure>& closures, const std::vector<std::size_t>& set) {
  std::set<std::size_t> of_a;
  std::set<std::size_t> of_b;
  for (const std::size_t i : set) {
    of_a.insert(closures[i].a);
    of_b.insert(closures[i].b);
  }
  return std::min(of_a.size(), of_b.size());
}

}  // namespace

ClosureChoice ChooseClosures(const std::vector<FoundClosure>& found,
                             const std::vector<SessionWay>& ways,
                             const MergeOptions& options,
                             const IsAsKnown& is_as_known) {
  constexpr std::size_t kFewButKnown = 2;
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> by_sessions;
  for (std::size_t i = 0; i < found.size(); ++i) {
    by_sessions[{found[i].a.session, found[i].b.session}].push_back(i);
  }
  ClosureChoice choice;
  for (const auto& [pair, indices] : by_sessions) {
    std::vector<Closure> closures;
    for (const std::size_t i : indices) {
      closures.push_back(
          {found[i].a.submap, found[i].b.submap, found[i].match.T_a_b, found[i].match.explained});
    }
    const auto sets =
        ConsistentSets(closures, {ways[pair.first], ways[pair.second]}, options.consistency, 2);
    SessionMeeting meeting{pair.first, pair.second, indices.size(), sets[0].size()};
    const double next_weight = sets.size() > 1 ? WeightOf(closures, sets[1]) : 0.0;
    const bool has_rival =
        next_weight > 0.0 && CountPlaces(closures, sets[1]) >= options.min_closures;
    if (next_weight > 0.0) meeting.margin = WeightOf(closures, sets[0]) / next_weight;
    const bool is_enough = CountPlaces(closures, sets[0]) >= options.min_closures;
    const bool is_known = is_as_known && sets[0].size() >= kFewButKnown &&
                          std::all_of(sets[0].begin(), sets[0].end(), [&](std::size_t k) {
                            return is_as_known(found[indices[k]]);
                          });
    meeting.is_believed =
        (is_enough || is_known) && (!has_rival || meeting.margin >= options.min_margin);
    choice.meetings.push_back(meeting);
    std::set<std::size_t> agreeing(sets[0].begin(), sets[0].end());
    for (std::size_t k = 0; k < indices.size(); ++k) {
      const bool is_believed = meeting.is_believed && agreeing.contains(k);
      (is_believed ? choice.believed : choice.rejected).push_back(found[indices[k]]);
    }
  }
  return choice;
}

}  // namespace atlas
