// The motion that a scan shows before it is tracked: what it is to be deskewed by (decision 0605).
#include <cstddef>
#include <vector>

#include "core/localization/tracking/place_tracker.h"

namespace atlas {
namespace {

void TakeEveryOther(const std::vector<Eigen::Vector3f>& points,
                    std::vector<Eigen::Vector3f>& taken) {
  taken.clear();
  for (std::size_t i = 0; i < points.size(); i += 2) {
    taken.push_back(points[i]);
  }
}

// They find the place to some centimetres. Of the returns those that come first are from
// everywhere.
void Thin(const ScanFeatures& scan, ScanFeatures& thinned) {
  TakeEveryOther(scan.columns, thinned.columns);
  TakeEveryOther(scan.ground, thinned.ground);
  const auto few = static_cast<std::ptrdiff_t>(scan.returns.size() / 4);
  thinned.returns.assign(scan.returns.begin(), scan.returns.begin() + few);
}

}  // namespace

std::optional<PlaceTracker::SeenMotion> PlaceTracker::MotionSeen(const ScanFeatures& scan) {
  if (is_first_ || lost_ > 0 || carried_ > 0 || scans_ > options_.pause.most_missing) {
    return std::nullopt;
  }
  Thin(scan, thinned_);
  const ScanFeatures& features = thinned_;
  MotionModel moved = Next();
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
