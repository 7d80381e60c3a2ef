// Whether a place goes where the vehicle does, as its scans tell: one that looks like it goes along
// with what repeats itself (decisions 0632 and 0634).
#include <optional>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {

bool PlaceTracker::Strays(const RegistrationResult& found, const ScanFeatures& features) {
  drift_.Fade();
  const Eigen::Vector4d before = drift_.strayed();
  const bool is_at_edge = IsAtEdge(features, found.T_world_level);
  if (is_first_ || !confirmation_.is_confirmed() || trail_.is_empty() ||
      !(is_at_edge || IsDoubtful(found) || IsUnexpected(found))) {
    return false;
  }
  const PosePrior expected{Prior().T_world_level, motion_.StepCovariance()};
  const ScanMotion moved = trail_.MotionTo(features, expected);
  at_hand_.has_broken = !trail_.IsKnown(moved);
  if (!trail_.IsSure(moved)) {
    return false;
  }
  const Eigen::Vector4d off = PoseDifference(moved.T_world_level, found.T_world_level);
  const double unknown_m = options_.edge.reachable_sigmas * SpreadOf(moved.covariance).along_m;
  if (off.head<2>().norm() > unknown_m) drift_.Stray(off);
  if (!drift_.HasStrayed()) {
    return false;
  }
  drift_.Return();
  at_hand_.has_strayed = !is_at_edge && known_ < options_.surprise.long_known;
  if (at_hand_.has_strayed) {
    return false;
  }
  carried_ = is_at_edge ? 1 : 0;
  trail_.BeginWay();
  Go(moved);
  motion_.Widen(before);
  return true;
}

bool PlaceTracker::IsUnexpected(const RegistrationResult& found) const {
  const Eigen::Vector4d off = PoseDifference(Prior().T_world_level, found.T_world_level);
  return IsSpeedKnown() && off.head<2>().norm() > options_.drift.unexpected_m;
}

bool PlaceTracker::MovesAsSeen(const ScanFeatures& features, const RegistrationResult& result) {
  if (carried_ > 0) {
    return drift_.StaysOff(PoseDifference(Prior().T_world_level, result.T_world_level));
  }
  std::optional<Pose> moved;
  if (at_hand_.own_step) {
    if (Tells(*at_hand_.own_step)) moved = LedBy(*at_hand_.own_step);
  } else if (trail_.is_empty()) {
    moved = result.T_world_level;
  } else {
    const Eigen::Vector4d sigmas(options_.drift.unsure_m, options_.drift.unsure_m,
                                 options_.trail.step_up_m, options_.drift.same_step_rad);
    const PosePrior expected{result.T_world_level, sigmas.cwiseAbs2().asDiagonal()};
    const ScanMotion seen = trail_.MotionTo(features, expected);
    if (trail_.IsKnown(seen)) moved = seen.T_world_level;
  }
  return drift_.MovesAlong(moved ? std::optional(PoseDifference(*moved, result.T_world_level))
                                 : std::nullopt);
}

// Of posts in a row any fits: a step of which that is true is uncertain by as much as they are
// apart.
bool PlaceTracker::Tells(const OwnStep& step) const {
  return step.is_known && SpreadOf(step.covariance).along_m <= options_.drift.same_step_m;
}

void PlaceTracker::GoAlong(const OwnStep& step) {
  at_hand_.own_step = step;
  const bool is_believed =
      confirmation_.is_confirmed() ? step.is_sure && Tells(step) : step.is_known;
  if (!is_believed) {
    return;
  }
  motion_.Carry(LedBy(step), Turned(LevelFrame(motion_.last()).linear(), step.covariance));
}

Pose PlaceTracker::LedBy(const OwnStep& step) const {
  return LevelFrame(motion_.last()) * step.T_last_now;
}

bool PlaceTracker::GoesWithRecent(const ScanFeatures& features, const PosePrior& expected) const {
  const ScanMotion moved = trail_.MotionTo(features, expected);
  return trail_.IsKnown(moved) &&
         !AreApart(moved.T_world_level, expected.T_world_level, options_.drift.same_step_m,
                   options_.drift.same_step_rad);
}

}  // namespace atlas
