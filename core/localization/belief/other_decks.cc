#include "core/localization/belief/other_decks.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace atlas {

DeckFinder::Deck DeckFinder::DeckAt(const MapWindow& map, double up_m) const {
  constexpr float kReach_m = 0.15F;  // of a surface, from a step
  const Eigen::Vector3f up(0.0F, 0.0F, static_cast<float>(up_m));
  const auto carried = std::count_if(ground_.begin(), ground_.end(), [&](const Eigen::Vector3f& p) {
    return map.NearestSurface(p + up, kReach_m).has_value();
  });
  return {up_m, static_cast<int>(carried)};
}

const std::vector<double>& DeckFinder::Find(const MapWindow& map,
                                            const ScanFeatures& features,
                                            const Pose& T_world_level) {
  constexpr double kStep_m = 0.2;
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map.origin()).cast<float>();
  ground_.clear();
  decks_.clear();
  ups_m_.clear();
  for (const Eigen::Vector3f& p : features.ground) {
    if (p.head<2>().norm() < options_.near_m) ground_.push_back(R * p + t);
  }
  if (ground_.size() < options_.min_ground) {
    return ups_m_;
  }
  const int steps = static_cast<int>(options_.reach_m / kStep_m);
  for (int step = -steps; step <= steps; ++step) {
    const double up_m = step * kStep_m;
    if (std::abs(up_m) < options_.least_m) continue;
    const Deck deck = DeckAt(map, up_m);
    if (deck.carried >= options_.min_share * static_cast<double>(ground_.size())) {
      decks_.push_back(deck);
    }
  }
  std::sort(decks_.begin(), decks_.end(), [](const Deck& a, const Deck& b) {
    return std::tie(b.carried, a.up_m) < std::tie(a.carried, b.up_m);
  });
  for (const Deck& deck : decks_) {
    const bool is_taken = std::any_of(ups_m_.begin(), ups_m_.end(), [&](double other_m) {
      return std::abs(deck.up_m - other_m) < options_.apart_m;
    });
    if (!is_taken && ups_m_.size() < options_.most) ups_m_.push_back(deck.up_m);
  }
  return ups_m_;
}

}  // namespace atlas
