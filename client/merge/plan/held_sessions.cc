#include "client/merge/plan/held_sessions.h"

#include <algorithm>
#include <cstddef>
#include <optional>

namespace atlas {
namespace {

// How far matches are from what the stored poses say, root mean square.
class Misfit {
 public:
  void Add(const Pose& T_world_a, const Pose& T_world_b, const Pose& T_a_b) {
    const Pose off = T_a_b.inverse() * (T_world_a.inverse() * T_world_b);
    const double turn_rad = Eigen::AngleAxisd(off.linear()).angle();
    squared_m2_ += off.translation().squaredNorm();
    squared_rad2_ += turn_rad * turn_rad;
    ++count_;
  }

  // Squared, of what is tolerated: above 1 it is too much.
  double ShareOf(double metres, double rad) const {
    return count_ == 0 ? 0.0
                       : std::max(squared_m2_ / (metres * metres), squared_rad2_ / (rad * rad)) /
                             static_cast<double>(count_);
  }

 private:
  double squared_m2_ = 0.0;
  double squared_rad2_ = 0.0;
  std::size_t count_ = 0;
};

class HeldOnes {
 public:
  HeldOnes(const std::vector<MergeSession>& sessions,
           const std::vector<FoundClosure>& closures,
           const MergeOptions& options)
      : sessions_(sessions), closures_(closures), options_(options) {}

  // How far the session is from what it says of itself.
  double WithinItself(std::size_t session, const std::vector<SessionLink>& links) const {
    Misfit misfit;
    for (const SessionLink& link : links) {
      if (!link.is_matched) continue;
      misfit.Add(StoredAt({session, link.from}), StoredAt({session, link.to}), link.T_from_to);
    }
    return ShareOf(misfit);
  }

  // It meets nobody, not even itself, and no position of it is known.
  bool IsNothingLearnedOf(std::size_t session) const {
    return std::none_of(closures_.begin(), closures_.end(),
                        [&](const FoundClosure& closure) {
                          return closure.a.session == session || closure.b.session == session;
                        }) &&
           std::none_of(sessions_[session].keyframes.begin(), sessions_[session].keyframes.end(),
                        [](const MergeKeyframe& keyframe) { return keyframe.prior.has_value(); });
  }

  // The session farthest from what its closures with those that are held say, if it is too far; of
  // equals the last one.
  std::optional<std::size_t> Worst(const std::vector<bool>& is_held) const {
    std::optional<std::size_t> worst;
    double most = 1.0;
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      const double share = is_held[i] ? ShareOf(ToOthers(i, is_held)) : 0.0;
      if (share <= 1.0 || share < most) continue;
      worst = i;
      most = share;
    }
    return worst;
  }

 private:
  Misfit ToOthers(std::size_t session, const std::vector<bool>& is_held) const {
    Misfit misfit;
    for (const FoundClosure& closure : closures_) {
      const bool is_own = closure.a.session == session || closure.b.session == session;
      if (!is_own || !is_held[closure.a.session] || !is_held[closure.b.session]) continue;
      misfit.Add(StoredAt(closure.a), StoredAt(closure.b), closure.match.T_a_b);
    }
    return misfit;
  }

  Pose StoredAt(const SubmapRef& ref) const {
    return StoredPose(sessions_[ref.session], At(sessions_, ref));
  }
  double ShareOf(const Misfit& misfit) const {
    return misfit.ShareOf(options_.held_m, options_.held_rad);
  }

  const std::vector<MergeSession>& sessions_;
  const std::vector<FoundClosure>& closures_;
  const MergeOptions& options_;
};

}  // namespace

std::vector<bool> HeldSessions(const std::vector<MergeSession>& sessions,
                               const std::vector<std::vector<SessionLink>>& links,
                               const std::vector<FoundClosure>& closures,
                               const MergeOptions& options) {
  const HeldOnes held(sessions, closures, options);
  std::vector<bool> is_held(sessions.size());
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    is_held[i] = !sessions[i].is_staged &&
                 (held.WithinItself(i, links[i]) <= 1.0 || held.IsNothingLearnedOf(i));
  }
  // Without the worst one others may fit.
  while (const std::optional<std::size_t> worst = held.Worst(is_held)) {
    is_held[*worst] = false;
  }
  return is_held;
}

}  // namespace atlas
