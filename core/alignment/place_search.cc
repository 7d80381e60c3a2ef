#include "core/alignment/place_search.h"

#include <algorithm>
#include <numbers>

namespace atlas {
namespace {

constexpr double kSector_rad = 2.0 * std::numbers::pi / static_cast<double>(RangeProfile::kSectors);

// The searcher stands where `place` is, turned by so many sectors.
Pose PoseAt(const SubmapPlace& place, std::size_t turn, const SubmapPlace& of_searcher) {
  Pose pose = Pose::Identity();
  pose.linear() =
      Eigen::AngleAxisd(static_cast<double>(turn) * kSector_rad, Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  pose.translation() = place.ground - pose.linear() * of_searcher.ground;
  return pose;
}

}  // namespace

std::vector<SubmapCandidate> SearchPlaces(std::span<const SubmapPlaces> submaps,
                                          SubmapPlaces searcher,
                                          const std::function<bool(std::size_t)>& may_be,
                                          const PlaceSearchOptions& options) {
  std::vector<SubmapCandidate> candidates;
  if (searcher.empty()) {
    return candidates;
  }
  const SubmapPlace& here = searcher[searcher.size() / 2];
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    if (!may_be(i)) continue;
    SubmapCandidate best{i, Pose::Identity(), options.max_difference};
    for (const SubmapPlace& place : submaps[i]) {
      const auto differences = Differences(here.profile, place.profile);
      const auto least = std::min_element(differences.begin(), differences.end());
      if (*least >= best.difference) continue;
      best.difference = *least;
      best.T_submap_searcher =
          PoseAt(place, static_cast<std::size_t>(least - differences.begin()), here);
    }
    if (best.difference < options.max_difference) candidates.push_back(best);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.difference < b.difference; });
  candidates.resize(std::min(candidates.size(), options.candidates));
  return candidates;
}

}  // namespace atlas
