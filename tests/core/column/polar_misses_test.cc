#include "core/column/polar_misses.h"

#include <cmath>
#include <map>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr float kCell_m = 0.1F;

class PolarMissesTest : public ::testing::Test {
 protected:
  // What one ray along azimuth 0 passes, by the middle of each step.
  std::map<int, HalfMask> Passed(const HalfSegments& halves, float range_m, float z_m) const {
    PolarMisses misses(rays_, halves);
    misses.Add(0.5F * rays_.ray_width_rad(), range_m, z_m);
    std::map<int, HalfMask> by_cell;  // x index of the cell
    misses.ForEach([&](std::uint32_t cell, HalfMask mask) {
      const auto ix = static_cast<int>(cell % static_cast<std::uint32_t>(rays_.grid().side()));
      by_cell[ix - rays_.grid().radius_cells] |= mask;
    });
    return by_cell;
  }

  RayTable rays_{GridGeometry{100'000, 200}};
};

TEST_F(PolarMissesTest, ALevelRayPassesTheHalfOverTheSensor) {
  const HalfSegments halves(1.0F, -1.73F);
  for (const auto& [ix, mask] : Passed(halves, 10.0F, 0.0F)) {
    EXPECT_EQ(mask, halves.Bit(0)) << ix;
  }
}

TEST_F(PolarMissesTest, EveryRayPassesTheHalvesAtItsHeight) {
  for (const float height_m : {0.1F, 0.2F, 0.5F, 1.0F, 2.0F}) {
    const HalfSegments halves(height_m, -1.73F);
    for (const float z_m : {-1.7F, -0.9F, -0.2F, 0.3F, 1.1F, 4.0F}) {
      const float range_m = 12.0F;
      for (const auto& [ix, mask] : Passed(halves, range_m, z_m)) {
        if (mask == 0) {
          continue;
        }
        // Somewhere over the cell or a step beside it the ray is at that height.
        const float near_m = z_m / range_m * (static_cast<float>(ix) * kCell_m - 0.07F);
        const float far_m = z_m / range_m * (static_cast<float>(ix + 1) * kCell_m + 0.07F);
        HalfMask expected = 0;
        for (int k = 0; k <= 20; ++k) {
          const float z = near_m + (far_m - near_m) * static_cast<float>(k) / 20.0F;
          expected |= halves.Bit(static_cast<int>(std::floor(z / halves.half_height_m())));
        }
        EXPECT_EQ(mask & ~expected, 0U) << height_m << " " << z_m << " " << ix;
      }
    }
  }
}

TEST_F(PolarMissesTest, ARayEndsACellBeforeItsReturn) {
  const HalfSegments halves(1.0F, -1.73F);
  const auto passed = Passed(halves, 8.0F, -1.0F);
  EXPECT_EQ(passed.rbegin()->first, 78);  // 7.8 to 7.9 m
  EXPECT_NE(passed.at(77), 0U);
  EXPECT_EQ(passed.begin()->first, 0);
}

TEST_F(PolarMissesTest, ReturnsTooNearOrBeyondTheGridAreNoTrouble) {
  const HalfSegments halves(1.0F, -1.73F);
  EXPECT_TRUE(Passed(halves, 0.0F, -1.0F).empty());
  EXPECT_TRUE(Passed(halves, 0.1F, 5.0F).empty());
  const auto passed = Passed(halves, 500.0F, 0.0F);
  EXPECT_EQ(passed.rbegin()->first, 199);
}

TEST_F(PolarMissesTest, ARayThatClimbsOutOfReachPassesNothingMore) {
  const HalfSegments halves(0.1F, -1.73F);  // up to 0.6 m above the sensor
  const auto passed = Passed(halves, 10.0F, 5.0F);
  EXPECT_NE(passed.at(0), 0U);
  EXPECT_EQ(passed.at(20), 0U);
}

TEST_F(PolarMissesTest, ARayThatFallsIntoReachPassesWhatLiesThere) {
  // Segments of 0.1 m reach 2.4 m above the foot: not to a sensor on a lorry's roof.
  const HalfSegments halves(0.1F, -3.2F);
  ASSERT_EQ(halves.Bit(0), 0U);
  const auto passed = Passed(halves, 10.0F, -3.0F);
  EXPECT_EQ(passed.at(5), 0U);
  for (int ix = 40; ix < 95; ++ix) {
    const float z_m = -0.3F * (static_cast<float>(ix) + 0.5F) * kCell_m;
    const HalfMask near = halves.SegmentAt(z_m - 0.02F) | halves.SegmentAt(z_m + 0.02F);
    EXPECT_NE(passed.at(ix) & near, 0U) << ix;
  }
}

}  // namespace
}  // namespace atlas
