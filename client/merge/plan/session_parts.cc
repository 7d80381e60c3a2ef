#include "client/merge/plan/session_parts.h"

#include <algorithm>
#include <optional>

namespace atlas {
namespace {

class Parts {
 public:
  Parts(const std::vector<MergeSession>& sessions,
        const std::vector<SessionWay>& ways,
        const ClosureChoice& choice)
      : sessions_(sessions), ways_(ways), choice_(choice), T_world_way_(sessions.size()) {
    parts_.part_of.resize(sessions.size());
  }

  SessionParts PutTogether() && {
    for (const bool is_staged : {false, true}) {
      for (std::size_t i = 0; i < sessions_.size(); ++i) {
        if (sessions_[i].is_staged == is_staged && !T_world_way_[i]) Grow(i);
      }
    }
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      std::vector<Pose>& poses = parts_.T_world_submap.emplace_back();
      for (const Pose& pose : ways_[i].T_session_submap) {
        poses.push_back(*T_world_way_[i] * pose);
      }
    }
    return std::move(parts_);
  }

 private:
  // From `first` on, always along the meeting for which most speaks.
  void Grow(std::size_t first) {
    Place(first, first, Pose::Identity());
    while (const SessionMeeting* next = StrongestBorder(first)) {
      const bool is_a_placed = IsIn(next->a, first);
      const FoundClosure& closure = LikeliestOf(*next);
      const Pose& in_a = ways_[next->a].T_session_submap[closure.a.submap];
      const Pose& in_b = ways_[next->b].T_session_submap[closure.b.submap];
      const Pose T_a_b = in_a * closure.match.T_a_b * in_b.inverse();
      if (is_a_placed) {
        Place(next->b, first, *T_world_way_[next->a] * T_a_b);
      } else {
        Place(next->a, first, *T_world_way_[next->b] * T_a_b.inverse());
      }
    }
  }

  void Place(std::size_t session, std::size_t part, const Pose& T_world_way) {
    T_world_way_[session] = T_world_way;
    parts_.part_of[session] = part;
  }

  bool IsIn(std::size_t session, std::size_t part) const {
    return T_world_way_[session].has_value() && parts_.part_of[session] == part;
  }

  // From a session that is in the part to one that is not.
  const SessionMeeting* StrongestBorder(std::size_t part) const {
    const SessionMeeting* strongest = nullptr;
    for (const SessionMeeting& meeting : choice_.meetings) {
      if (!meeting.is_believed || IsIn(meeting.a, part) == IsIn(meeting.b, part)) continue;
      if (strongest == nullptr || meeting.agreeing > strongest->agreeing) strongest = &meeting;
    }
    return strongest;
  }

  const FoundClosure& LikeliestOf(const SessionMeeting& meeting) const {
    const FoundClosure* likeliest = nullptr;
    for (const FoundClosure& closure : choice_.believed) {
      if (closure.a.session != meeting.a || closure.b.session != meeting.b) continue;
      if (likeliest == nullptr || closure.match.explained > likeliest->match.explained) {
        likeliest = &closure;
      }
    }
    return *likeliest;  // a meeting that is believed has some
  }

  const std::vector<MergeSession>& sessions_;
  const std::vector<SessionWay>& ways_;
  const ClosureChoice& choice_;
  std::vector<std::optional<Pose>> T_world_way_;
  SessionParts parts_;
};

}  // namespace

SessionParts PutTogether(const std::vector<MergeSession>& sessions,
                         const std::vector<SessionWay>& ways,
                         const ClosureChoice& choice) {
  return Parts(sessions, ways, choice).PutTogether();
}

}  // namespace atlas
