#include "core/tile/layer_association.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/tile/overlap_table.h"

namespace atlas {
namespace {

// OLR of N(0, 1) and N(distance, ratio), equally weighted: the saddle's density over the smaller
// peak's, found by walking the mixture's density; 1 where there is only one peak.
double OverlapRate(double distance, double ratio) {
  const auto density = [&](double x) {
    const double wide = (x - distance) / ratio;
    return std::exp(-0.5 * x * x) + std::exp(-0.5 * wide * wide) / ratio;
  };
  constexpr int kSteps = 20'000;
  const double step = (distance + 1.0) / kSteps;
  std::vector<double> peaks;
  double saddle = 0.0;
  double before = density(-0.5 - step);
  double here = density(-0.5);
  for (int i = 0; i < kSteps; ++i) {
    const double after = density(-0.5 + (i + 1) * step);
    if (here > before && here >= after) {
      peaks.push_back(here);
    } else if (here < before && here <= after) {
      saddle = here;
    }
    before = here;
    here = after;
  }
  return peaks.size() < 2 ? 1.0 : saddle / std::min(peaks.front(), peaks.back());
}

double LargestOverlappingDistance(double ratio) {
  double low = 1.0;
  double high = 3.0 + 1.3 * ratio;
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (low + high);
    (OverlapRate(middle, ratio) > 0.6 ? low : high) = middle;
  }
  return low;
}

TEST(OverlapTableTest, IsWhatTheMixturesDensitySays) {
  for (std::size_t i = 0; i < kOverlapLimit.size(); i += 5) {
    const double ratio =
        std::ldexp(1.0 + static_cast<double>(i % 16) / 16.0, static_cast<int>(i / 16));
    const double expected = LargestOverlappingDistance(ratio);
    EXPECT_NEAR(kOverlapLimit[i] / 4096.0, expected, 1e-3 * expected) << "ratio " << ratio;
  }
}

TEST(LayerAssociationTest, OverlapFollowsTheMixtureBetweenTheTablesEntries) {
  for (const double ratio : {1.0, 1.03, 1.97, 2.9, 5.3, 7.7, 15.1, 33.0, 63.0}) {
    constexpr std::uint32_t kSigma = 1'000;  // 0.1 m
    const auto wide = static_cast<std::uint32_t>(std::lround(kSigma * ratio));
    const double limit_mm = 100.0 * LargestOverlappingDistance(ratio);
    const auto at = [&](double factor) {
      const auto distance_mm = static_cast<std::int32_t>(std::lround(limit_mm * factor));
      EXPECT_EQ(OverlapsAsOneLayer({0, kSigma}, {distance_mm, wide}),
                OverlapsAsOneLayer({distance_mm, wide}, {0, kSigma}));
      return OverlapsAsOneLayer({0, kSigma}, {distance_mm, wide});
    };
    EXPECT_TRUE(at(0.995)) << ratio;
    EXPECT_FALSE(at(1.005)) << ratio;
  }
}

TEST(LayerAssociationTest, GoesOnLinearlyBeyondTheTable) {
  const double ratio = 200.0;
  const double limit_mm = 1.0 * LargestOverlappingDistance(ratio);
  const auto near_mm = static_cast<std::int32_t>(limit_mm * 0.98);
  const auto far_mm = static_cast<std::int32_t>(limit_mm * 1.02);
  EXPECT_TRUE(OverlapsAsOneLayer({0, 10}, {near_mm, 2'000}));
  EXPECT_FALSE(OverlapsAsOneLayer({0, 10}, {far_mm, 2'000}));
}

std::vector<std::uint32_t> Chain(const std::vector<AltitudeEstimate>& sorted,
                                 FusionPreset preset = FusionPreset::kStrict) {
  MapProfile profile;
  profile.preset = preset;
  std::vector<std::uint32_t> labels(sorted.size());
  const std::uint32_t count = ChainLayers(sorted, profile, labels);
  EXPECT_EQ(count, sorted.empty() ? 0 : labels.back() + 1);
  return labels;
}

using Labels = std::vector<std::uint32_t>;

TEST(LayerAssociationTest, GatesOverruleTheOverlapRate) {
  // Seen from 10 m, sigma is 1 m: the overlap rate alone would join floors 3 m apart.
  EXPECT_EQ(Chain({{0, 9'749}, {3'000, 9'749}}), (Labels{0, 1}));
  EXPECT_EQ(Chain({{0, 9'749}, {3'000, 9'749}}, FusionPreset::kPaper), (Labels{0, 0}));
  EXPECT_EQ(Chain({{0, 9'749}, {2'000, 9'749}}), (Labels{0, 1}));
  EXPECT_EQ(Chain({{0, 9'749}, {1'499, 9'749}}), (Labels{0, 0}));
  // However sure both are, half a metre is one layer.
  EXPECT_EQ(Chain({{0, 10}, {500, 10}}), (Labels{0, 0}));
  EXPECT_EQ(Chain({{0, 10}, {501, 10}}), (Labels{0, 1}));
  EXPECT_EQ(Chain({{0, 10}, {500, 10}}, FusionPreset::kPaper), (Labels{0, 1}));
}

TEST(LayerAssociationTest, NoLayerIsThickerThanItsSpan) {
  // A ramp of representatives 0.4 m apart: chained without end by neighbours, cut every 1.5 m.
  std::vector<AltitudeEstimate> ramp;
  for (int i = 0; i < 9; ++i) {
    ramp.push_back({400 * i, 2'000});
  }
  EXPECT_EQ(Chain(ramp), (Labels{0, 0, 0, 0, 1, 1, 1, 1, 2}));
  EXPECT_EQ(Chain(ramp, FusionPreset::kPaper), Labels(9, 0));
  EXPECT_EQ(Chain({}), Labels());
}

}  // namespace
}  // namespace atlas
