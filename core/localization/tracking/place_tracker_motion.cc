// The motion that a scan shows before it is tracked: what it is to be deskewed by (decision 0605).
#include <optional>
#include <utility>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {
std::optional<PlaceTracker::SeenMotion> PlaceTracker::MotionSeen(const ScanFeatures& scan) {
  if (is_first_ || lost_ > 0 || carried_ > 0 || scans_ > options_.pause.most_missing) {
    return std::nullopt;
  }
  MotionModel moved = Arrived(scan);
  Thin(scan, thinned_);
  const ScanFeatures& features = thinned_;
  const PosePrior prior = PriorOf(moved);
  const PosePrior among_features{prior.T_world_level,
                                 options_.seen.information_share * prior.covariance};
  RegistrationResult seen =
      Register(map_.window(), features, prior.T_world_level, among_features, options_.registration);
  if (IsDoubtful(seen)) {
    for (const Pose& start :
         SearchPoses(map_.coarse(), map_.window().origin(), features, prior.T_world_level,
                     options_.doubt.search_reach, options_.search)) {
      RegistrationResult other = Register(map_.window(), features, start, options_.registration);
      if (other.evidence > seen.evidence) seen = std::move(other);
    }
  }
  if (seen.fit < options_.health.min_fit) {
    return std::nullopt;
  }
  moved.Turn(seen.T_world_level, Eigen::Matrix4d::Identity());
  return SeenMotion{moved.T_now_later(), seen.fit};
}

}  // namespace atlas
