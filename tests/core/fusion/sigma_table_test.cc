#include "core/fusion/sigma_table.h"

#include <cmath>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(SigmaTableTest, FollowsThePapersFormula) {
  const MapProfile profile;
  const SigmaTable table(profile, 300);
  for (std::size_t d2 = 0; d2 < 90'000; d2 += 7) {
    const double d_m = 0.1 * std::sqrt(static_cast<double>(d2) + 0.5);
    const std::uint16_t step = table.Step(d2);
    const double sigma_m = 0.087489 * d_m + 0.1;
    EXPECT_NEAR(table.Sigma_100um(AltitudeSource::kMeasured, step) * 1e-4, sigma_m, 7e-4);
    EXPECT_NEAR(table.Sigma_100um(AltitudeSource::kInterpolated, step) * 1e-4,
                sigma_m + 1e-3 * profile.sigma_interpolated_mm, 7e-4);
    EXPECT_NEAR(table.Sigma_100um(AltitudeSource::kExtrapolated, step) * 1e-4, sigma_m + 0.3, 7e-4);
    const double weight = kUnitWeight * 0.01 / (sigma_m * sigma_m);
    EXPECT_NEAR(table.Weight(AltitudeSource::kMeasured, step), weight, 0.015 * weight + 1);
  }
  EXPECT_EQ(table.SigmaOfWeight_100um(kUnitWeight), 1'000);
  EXPECT_EQ(table.SigmaOfWeight_100um(4 * kUnitWeight), 500);
  EXPECT_EQ(table.SigmaOfWeight_100um(1), 65'535);
}

}  // namespace
}  // namespace atlas
