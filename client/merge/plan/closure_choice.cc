#include "client/merge/plan/closure_choice.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace atlas {
namespace {

constexpr std::size_t kFewButKnown = 2;  // places

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

// What two sessions have to say for their meeting.
struct Judged {
  SessionMeeting meeting;
  std::vector<std::size_t> found;  // its closures, of all that were found
  std::vector<std::size_t> set;    // of these the ones that agree,
  std::size_t places = 0;          // at so many places
  bool has_rival = false;          // that is too good for it to be believed,
  bool has_few_rival = false;      // or for few to be
};

Judged Judge(const std::vector<FoundClosure>& found,
             const std::vector<std::size_t>& indices,
             const std::vector<SessionWay>& ways,
             const MergeOptions& options) {
  const std::size_t a = found[indices[0]].a.session;
  const std::size_t b = found[indices[0]].b.session;
  std::vector<Closure> closures;
  for (const std::size_t i : indices) {
    closures.push_back(
        {found[i].a.submap, found[i].b.submap, found[i].match.T_a_b, found[i].match.explained});
  }
  auto sets = ConsistentSets(closures, {ways[a], ways[b]}, options.consistency, 2);
  Judged judged;
  judged.meeting = {a, b, indices.size(), sets[0].size()};
  judged.found = indices;
  SessionMeeting& meeting = judged.meeting;
  const double next_weight = sets.size() > 1 ? WeightOf(closures, sets[1]) : 0.0;
  if (next_weight > 0.0) {
    meeting.margin = WeightOf(closures, sets[0]) / next_weight;
    const std::size_t next = CountPlaces(closures, sets[1]);
    const bool is_close = meeting.margin < options.min_margin;
    judged.has_rival = is_close && next >= options.min_closures;
    judged.has_few_rival = is_close && next >= kFewButKnown;
  }
  judged.places = CountPlaces(closures, sets[0]);
  meeting.is_believed = judged.places >= options.min_closures && !judged.has_rival;
  judged.set = std::move(sets[0]);
  return judged;
}

// By session: equal of those that hang together by what is believed.
std::vector<std::size_t> PartsOf(const std::vector<Judged>& all, std::size_t sessions) {
  std::vector<std::size_t> part_of(sessions);
  std::iota(part_of.begin(), part_of.end(), 0U);
  for (const Judged& one : all) {
    if (!one.meeting.is_believed) continue;
    const std::size_t gone = part_of[one.meeting.b];
    const std::size_t stays = part_of[one.meeting.a];
    std::replace(part_of.begin(), part_of.end(), gone, stays);
  }
  return part_of;
}

bool IsKnown(const Judged& judged,
             const std::vector<FoundClosure>& found,
             const IsAsKnown& is_as_known) {
  return judged.places >= kFewButKnown && !judged.has_few_rival &&
         std::all_of(judged.set.begin(), judged.set.end(),
                     [&](std::size_t k) { return is_as_known(found[judged.found[k]]); });
}

// Parts are those without them: few are no reason to believe few. What two visits of one session
// have to do with each other is known from that session alone, on both sides of a jump nothing is.
void BelieveKnown(const std::vector<FoundClosure>& found,
                  const IsAsKnown& is_as_known,
                  std::size_t sessions,
                  std::vector<Judged>& all) {
  const std::vector<std::size_t> part_of = PartsOf(all, sessions);
  for (Judged& one : all) {
    SessionMeeting& meeting = one.meeting;
    if (meeting.a == meeting.b || part_of[meeting.a] != part_of[meeting.b]) continue;
    meeting.is_believed = meeting.is_believed || IsKnown(one, found, is_as_known);
  }
}

}  // namespace

ClosureChoice ChooseClosures(const std::vector<FoundClosure>& found,
                             const std::vector<SessionWay>& ways,
                             const MergeOptions& options,
                             const IsAsKnown& is_as_known) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> by_sessions;
  for (std::size_t i = 0; i < found.size(); ++i) {
    by_sessions[{found[i].a.session, found[i].b.session}].push_back(i);
  }
  std::vector<Judged> all;
  for (const auto& [pair, indices] : by_sessions) {
    all.push_back(Judge(found, indices, ways, options));
  }
  if (is_as_known) BelieveKnown(found, is_as_known, ways.size(), all);
  ClosureChoice choice;
  for (const Judged& one : all) {
    choice.meetings.push_back(one.meeting);
    const std::set<std::size_t> agreeing(one.set.begin(), one.set.end());
    for (std::size_t k = 0; k < one.found.size(); ++k) {
      const bool is_believed = one.meeting.is_believed && agreeing.contains(k);
      (is_believed ? choice.believed : choice.rejected).push_back(found[one.found[k]]);
    }
  }
  return choice;
}

}  // namespace atlas
