#include "core/scan/rings/ring_origin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace atlas {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kTurn = 2.0F * kPi;

}  // namespace

std::vector<float> SearchOrigins(const ReturnDirections& directions) {
  constexpr int kOrigins = 3;
  constexpr int kBins = 4096;  // narrower than the gap between two returns
  constexpr float kBinsPerRad = static_cast<float>(kBins) / kTurn;
  std::array<int, kBins> leaps_over_passes{};  // at the bins' lower edges
  for (std::size_t i = 1; i < directions.slope.size(); ++i) {
    float ahead = directions.azimuth_rad[i] - directions.azimuth_rad[i - 1];
    ahead += ahead < -kPi ? kTurn : 0.0F;
    if (ahead <= 0.0F || ahead >= kNeighbours_rad) {
      continue;
    }
    const int first = static_cast<int>(directions.azimuth_rad[i - 1] * kBinsPerRad) + 1;
    const int last = static_cast<int>((directions.azimuth_rad[i - 1] + ahead) * kBinsPerRad);
    const bool is_leap = std::abs(directions.slope[i] - directions.slope[i - 1]) > kMinLeapSlope;
    for (int bin = first; bin <= last; ++bin) {
      leaps_over_passes[static_cast<std::size_t>(bin % kBins)] += is_leap ? 1 : -1;
    }
  }
  std::vector<float> origins;
  for (int k = 0; k < kOrigins; ++k) {
    const auto best =
        static_cast<int>(std::max_element(leaps_over_passes.begin(), leaps_over_passes.end()) -
                         leaps_over_passes.begin());
    origins.push_back(static_cast<float>(best) / kBinsPerRad);
    constexpr int kReach = static_cast<int>(kNeighbours_rad * kBinsPerRad);
    for (int bin = best - kReach; bin <= best + kReach; ++bin) {
      leaps_over_passes[static_cast<std::size_t>((bin + kBins) % kBins)] =
          std::numeric_limits<int>::min();
    }
  }
  return origins;
}

}  // namespace atlas
