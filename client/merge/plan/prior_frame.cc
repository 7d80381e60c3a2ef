#include "client/merge/plan/prior_frame.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "client/merge/plan/prior_fit.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

void AddPairs(const MergeSession& session,
              const std::vector<Pose>& T_world_submap,
              std::vector<KnownPair>& pairs) {
  for (std::size_t k = 0; k < session.submaps.size(); ++k) {
    const MergeSubmap& submap = session.submaps[k];
    const Pose T_now_fused = T_world_submap[k] * submap.T_world_submap.inverse();
    for (std::size_t i = submap.cut.begin; i < submap.cut.end; ++i) {
      const auto& prior = session.keyframes[i].prior;
      if (!prior) continue;
      pairs.push_back(
          {T_now_fused * session.T_world_sensor[i].translation(), prior->p_world, prior->radius_m});
    }
  }
}

class Part {
 public:
  Part(std::size_t part,
       const std::vector<MergeSession>& sessions,
       const std::vector<std::size_t>& part_of,
       const PriorOptions& options)
      : sessions_(sessions), options_(options) {
    for (std::size_t i = 0; i < sessions.size(); ++i) {
      if (part_of[i] == part) members_.push_back(i);
    }
  }

  const std::vector<std::size_t>& members() const { return members_; }

  // Where nothing of it is held: by most positions of all. Empty: it is done. Else why not.
  std::string Place(SubmapPoses& T_world_submap) const {
    std::vector<KnownPair> pairs;
    for (const std::size_t i : members_) AddPairs(sessions_[i], T_world_submap[i], pairs);
    const auto T_new_old = FitToPriors(pairs, options_);
    if (!T_new_old) return "they do not agree on one place, or are too few or too near each other";
    const double shift_m = ShiftOfMap(*T_new_old, T_world_submap);
    if (shift_m > options_.max_frame_shift_m) {
      return StrCat("the map would be moved by ", std::round(shift_m),
                    " m: it seems to have another frame");
    }
    for (const std::size_t i : members_) {
      for (Pose& pose : T_world_submap[i]) pose = *T_new_old * pose;
    }
    return {};
  }

  // Whether the session's own agree with where it is now.
  std::string Judge(std::size_t session, bool stays, const SubmapPoses& T_world_submap) const {
    std::vector<KnownPair> pairs;
    AddPairs(sessions_[session], T_world_submap[session], pairs);
    const double slack_m = stays ? options_.held_slack_m : options_.slack_m;
    const std::size_t agreeing = CountAgreeing(pairs, Pose::Identity(), slack_m);
    const bool is_believed =
        static_cast<double>(agreeing) >= options_.min_share * static_cast<double>(pairs.size());
    if (is_believed) return {};
    return StrCat(pairs.size() - agreeing, " of ", pairs.size(), " have it elsewhere than ",
                  stays ? "the map, which stays" : "those of the others");
  }

 private:
  // Of its submaps that are in the map, root mean square.
  double ShiftOfMap(const Pose& T_new_old, const SubmapPoses& T_world_submap) const {
    double squares_m2 = 0.0;
    std::size_t count = 0;
    for (const std::size_t i : members_) {
      if (sessions_[i].is_staged) continue;
      for (const Pose& pose : T_world_submap[i]) {
        squares_m2 += (T_new_old * pose.translation() - pose.translation()).squaredNorm();
        ++count;
      }
    }
    return count == 0 ? 0.0 : std::sqrt(squares_m2 / static_cast<double>(count));
  }

  const std::vector<MergeSession>& sessions_;
  const PriorOptions& options_;
  std::vector<std::size_t> members_;
};

}  // namespace

std::size_t CountPriors(const MergeSession& session) {
  return static_cast<std::size_t>(
      std::count_if(session.keyframes.begin(), session.keyframes.end(),
                    [](const MergeKeyframe& keyframe) { return keyframe.prior.has_value(); }));
}

std::vector<PriorUse> PlaceByPriors(const std::vector<MergeSession>& sessions,
                                    const std::vector<std::size_t>& part_of,
                                    const std::vector<bool>& is_held,
                                    const PriorOptions& options,
                                    SubmapPoses& T_world_submap) {
  std::vector<PriorUse> uses(sessions.size());
  std::set<std::size_t> parts;  // that have positions
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    uses[i].count = CountPriors(sessions[i]);
    if (uses[i].count > 0) parts.insert(part_of[i]);
  }
  for (const std::size_t number : parts) {
    const Part part(number, sessions, part_of, options);
    const bool stays = std::any_of(part.members().begin(), part.members().end(),
                                   [&](std::size_t i) { return is_held[i]; });
    const std::string no_place = stays ? "" : part.Place(T_world_submap);
    for (const std::size_t i : part.members()) {
      if (uses[i].count == 0) continue;
      uses[i].why_not = no_place;
      if (no_place.empty()) {
        uses[i].why_not = part.Judge(i, stays, T_world_submap);
      }
      uses[i].is_used = uses[i].why_not.empty();
    }
  }
  return uses;
}

double MedianOff(const MergeSession& session, const std::vector<Pose>& T_world_submap) {
  std::vector<KnownPair> pairs;
  AddPairs(session, T_world_submap, pairs);
  if (pairs.empty()) return 0.0;
  std::vector<double> off_m;
  off_m.reserve(pairs.size());
  for (const KnownPair& pair : pairs) off_m.push_back((pair.p_part - pair.p_world).norm());
  const auto middle = off_m.begin() + static_cast<std::ptrdiff_t>(off_m.size() / 2);
  std::nth_element(off_m.begin(), middle, off_m.end());
  return *middle;
}

}  // namespace atlas
