#include "client/merge/plan/held_sessions.h"

#include <cmath>
#include <cstddef>

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

  bool IsWithin(double metres, double rad) const {
    return count_ == 0 || (squared_m2_ <= metres * metres * static_cast<double>(count_) &&
                           squared_rad2_ <= rad * rad * static_cast<double>(count_));
  }

 private:
  double squared_m2_ = 0.0;
  double squared_rad2_ = 0.0;
  std::size_t count_ = 0;
};

}  // namespace

std::vector<bool> HeldSessions(const std::vector<MergeSession>& sessions,
                               const std::vector<std::vector<SessionLink>>& links,
                               const std::vector<FoundClosure>& closures,
                               const MergeOptions& options) {
  const auto stored_at = [&](const SubmapRef& ref) {
    return StoredPose(sessions[ref.session], At(sessions, ref));
  };
  std::vector<bool> is_held(sessions.size());
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    Misfit misfit;
    for (const SessionLink& link : links[i]) {
      if (!link.is_matched) continue;
      misfit.Add(stored_at({i, link.from}), stored_at({i, link.to}), link.T_from_to);
    }
    is_held[i] = !sessions[i].is_staged && misfit.IsWithin(options.held_m, options.held_rad);
  }
  // One that does not fit another is let go; so are, after it, those that only fit it.
  for (bool has_changed = true; has_changed;) {
    has_changed = false;
    for (std::size_t i = 0; i < sessions.size(); ++i) {
      if (!is_held[i]) continue;
      Misfit misfit;
      for (const FoundClosure& closure : closures) {
        const bool is_own = closure.a.session == i || closure.b.session == i;
        if (!is_own || !is_held[closure.a.session] || !is_held[closure.b.session]) continue;
        misfit.Add(stored_at(closure.a), stored_at(closure.b), closure.match.T_a_b);
      }
      if (misfit.IsWithin(options.held_m, options.held_rad)) continue;
      is_held[i] = false;
      has_changed = true;
    }
  }
  return is_held;
}

}  // namespace atlas
