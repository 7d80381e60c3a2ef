#include "core/fusion/observation/sigma_table.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(SigmaTableTest, FollowsThePapersFormula) {
  MapProfile profile;
  profile.sigma_interpolated_mm = 50;
  profile.sigma_extrapolated_mm = 300;
  const SigmaTable table(profile, 300);
  const auto deviation = [&](AltitudeSource source, std::size_t d2, double sigma_m) {
    return std::abs(table.Sigma100um(source, table.Step(d2)) * 1e-4 - sigma_m);
  };
  double largest = 0.0;
  for (std::size_t d2 = 0; d2 < 90'000; d2 += 7) {
    const double sigma_m = 0.087489 * 0.1 * std::sqrt(static_cast<double>(d2) + 0.5) + 0.1;
    largest = std::max({largest, deviation(AltitudeSource::kMeasured, d2, sigma_m),
                        deviation(AltitudeSource::kInterpolated, d2, sigma_m + 0.05),
                        deviation(AltitudeSource::kExtrapolated, d2, sigma_m + 0.3)});
  }
  EXPECT_LT(largest, 7e-4);
}

TEST(SigmaTableTest, WeightsAreInverseVariances) {
  const SigmaTable table(MapProfile(), 300);
  for (std::size_t d2 = 0; d2 < 90'000; d2 += 7) {
    const double sigma_m = 0.087489 * 0.1 * std::sqrt(static_cast<double>(d2) + 0.5) + 0.1;
    const double weight = kUnitWeight * 0.01 / (sigma_m * sigma_m);
    EXPECT_NEAR(table.Weight(AltitudeSource::kMeasured, table.Step(d2)), weight,
                0.015 * weight + 1);
  }
  EXPECT_EQ(table.SigmaOfWeight100um(kUnitWeight), 992);  // 1000, rounded
  EXPECT_EQ(table.SigmaOfWeight100um(4 * kUnitWeight), 496);
  EXPECT_EQ(table.SigmaOfWeight100um(1), 63'488);
}

}  // namespace
}  // namespace atlas
