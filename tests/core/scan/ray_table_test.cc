#include "core/scan/ray_table.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/scan/fast_atan2.h"

namespace atlas {
namespace {

TEST(RayTableTest, EveryCellWithinTheRadiusLiesBelowARay) {
  const GridGeometry grid{100'000, 100};
  const RayTable rays(grid);
  std::vector<int> seen(grid.size());
  for (int ray = 0; ray < rays.rays(); ++ray) {
    for (int step = 0; step < rays.steps(); ++step) {
      ++seen[rays.Cells(ray)[step]];
    }
  }
  int missed = 0;
  for (std::int32_t y = -100; y < 100; ++y) {
    for (std::int32_t x = -100; x < 100; ++x) {
      const double distance_m = 0.1 * std::hypot(x + 0.5, y + 0.5);
      missed += distance_m < 9.8 && seen[grid.Index(x, y)] == 0 ? 1 : 0;
    }
  }
  EXPECT_LT(missed, 30);  // corners that a line just misses, of 30,000
}

TEST(RayTableTest, StepsLieWhereTheySay) {
  const RayTable rays(GridGeometry{200'000, 50});
  const GridGeometry& grid = rays.grid();
  for (const int ray : {0, 17, rays.rays() / 2, rays.rays() - 1}) {
    const double azimuth = (ray + 0.5) * static_cast<double>(rays.ray_width_rad());
    EXPECT_EQ(rays.Ray(static_cast<float>(azimuth)), ray);
    const float range_m = rays.StepRange(20);
    const auto x = static_cast<std::int32_t>(std::floor(range_m * std::cos(azimuth) / 0.2));
    const auto y = static_cast<std::int32_t>(std::floor(range_m * std::sin(azimuth) / 0.2));
    EXPECT_EQ(rays.Cells(ray)[20], grid.Index(x, y));
  }
}

TEST(FastAtan2Test, IsGoodToTenMicroradians) {
  for (int i = 0; i < 3600; ++i) {
    const double angle = (i + 0.37) * 0.1 * M_PI / 180.0 - M_PI;
    const auto x = static_cast<float>(13.0 * std::cos(angle));
    const auto y = static_cast<float>(13.0 * std::sin(angle));
    EXPECT_NEAR(FastAtan2(y, x), std::atan2(y, x), 1.5e-5);
  }
  EXPECT_EQ(FastAtan2(0.0F, 0.0F), 0.0F);
}

}  // namespace
}  // namespace atlas
