#include "core/localization/other_decks.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

constexpr double kStep_m = 0.2;
constexpr float kReach_m = 0.15F;  // of a surface, from a step

struct Deck {
  double up_m = 0.0;
  int carried = 0;
};

// Of the scan's ground that lies near the sensor, in the window's frame.
std::vector<Eigen::Vector3f> NearGround(const MapWindow& map,
                                        const ScanFeatures& features,
                                        const Pose& T_world_level,
                                        float near_m) {
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map.origin()).cast<float>();
  std::vector<Eigen::Vector3f> ground;
  for (const Eigen::Vector3f& p : features.ground) {
    if (p.head<2>().norm() < near_m) ground.push_back(R * p + t);
  }
  return ground;
}

Deck DeckAt(const MapWindow& map, const std::vector<Eigen::Vector3f>& ground, double up_m) {
  const Eigen::Vector3f up(0.0F, 0.0F, static_cast<float>(up_m));
  const auto carried = std::count_if(ground.begin(), ground.end(), [&](const Eigen::Vector3f& p) {
    return map.NearestSurface(p + up, kReach_m).has_value();
  });
  return {up_m, static_cast<int>(carried)};
}

}  // namespace

std::vector<double> OtherDecks(const MapWindow& map,
                               const ScanFeatures& features,
                               const Pose& T_world_level,
                               const DeckOptions& options) {
  const std::vector<Eigen::Vector3f> ground =
      NearGround(map, features, T_world_level, options.near_m);
  if (ground.size() < options.min_ground) {
    return {};
  }
  std::vector<Deck> decks;
  const int steps = static_cast<int>(options.reach_m / kStep_m);
  for (int step = -steps; step <= steps; ++step) {
    const double up_m = step * kStep_m;
    if (std::abs(up_m) < options.apart_m) continue;
    const Deck deck = DeckAt(map, ground, up_m);
    if (deck.carried >= options.min_share * static_cast<double>(ground.size())) {
      decks.push_back(deck);
    }
  }
  std::stable_sort(decks.begin(), decks.end(),
                   [](const Deck& a, const Deck& b) { return a.carried > b.carried; });
  std::vector<double> ups_m;
  for (const Deck& deck : decks) {
    const bool is_taken = std::any_of(ups_m.begin(), ups_m.end(), [&](double other_m) {
      return std::abs(deck.up_m - other_m) < options.apart_m;
    });
    if (!is_taken && ups_m.size() < options.most) ups_m.push_back(deck.up_m);
  }
  return ups_m;
}

}  // namespace atlas
