// Columns of scans drawn return by return. The sensor is 1.8 m above flat ground.
#include "core/column/column_tracer.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/core/column/column_world.h"

namespace atlas {
namespace {

using testing::ColumnWorld;
using testing::WithSegments;

TEST(ColumnTracerTest, AReturnHitsItsOwnSegmentAndItsRayMissesTheOthers) {
  ColumnWorld world;
  world.FarWall(-1.6F, 2.9F);
  world.Trace();
  for (const float z_m : {-0.5F, 0.5F, 1.5F, 2.5F}) {
    EXPECT_EQ(world.State(9.02, 0.05, z_m), kNibbleHit) << z_m;
  }
  EXPECT_EQ(world.State(9.02, 0.05, 3.5), 0);
  EXPECT_EQ(world.State(6.0, 0.05, 0.5), kNibbleMiss);
  EXPECT_EQ(world.State(6.0, 0.05, -0.5), kNibbleMiss);
  EXPECT_EQ(world.State(6.0, 0.05, 2.5), 0);   // the uppermost ray is at 2 m there
  EXPECT_EQ(world.State(6.0, 1.05, 0.5), 0);   // no ray there
  EXPECT_EQ(world.State(9.35, 0.05, 0.5), 0);  // nor behind the wall
}

TEST(ColumnTracerTest, ReturnsLowerThanTheBaseOffsetMakeNoHitAndNoMiss) {
  ColumnWorld world;
  world.Hit(5.05F, 0.05F, -1.55F);  // 0.25 m above the ground
  world.Hit(6.05F, 0.05F, -1.45F);  // 0.35 m
  world.FarWall(-1.75F, 1.0F);
  world.Trace();
  EXPECT_EQ(world.State(5.05, 0.05, -1.5), 0);
  EXPECT_EQ(world.State(6.05, 0.05, -1.5), kNibbleHit);
  EXPECT_EQ(world.State(4.05, 0.05, -0.5), kNibbleMiss);
}

TEST(ColumnTracerTest, TheBaseOffsetCountsFromTheGroundOfTheCell) {
  ColumnWorld world;
  world.SetGround([](double x, double) { return x > 4.0 ? -1.2 : -1.8; });
  world.Hit(5.05F, 0.05F, -1.0F);   // 0.2 m above its ground
  world.Hit(-5.05F, 0.05F, -1.0F);  // 0.8 m
  world.Trace();
  EXPECT_EQ(world.State(5.05, 0.05, -0.95), 0);
  EXPECT_EQ(world.State(-5.05, 0.05, -0.95), kNibbleHit);
}

TEST(ColumnTracerTest, ASegmentIsMissedOnlyWhereBothHalvesWerePassed) {
  ColumnWorld upper;
  upper.FarWall(0.9F, 1.35F);  // at 6 m: 0.6 to 0.9, the upper half of the segment over the sensor
  upper.Trace();
  EXPECT_EQ(upper.State(6.0, 0.05, 0.5), 0);
  ColumnWorld lower;
  lower.FarWall(0.2F, 0.6F);
  lower.Trace();
  EXPECT_EQ(lower.State(6.0, 0.05, 0.5), 0);
  ColumnWorld both;
  both.FarWall(0.9F, 1.35F);
  both.FarWall(0.2F, 0.6F);
  both.Trace();
  EXPECT_EQ(both.State(6.0, 0.05, 0.5), kNibbleMiss);
}

TEST(ColumnTracerTest, TheLowerHalfOfTheGroundsOwnSegmentIsGround) {
  // Only rays through its upper half: -1.5 to -1 m at 6 m.
  ColumnWorld world;
  world.FarWall(-2.0F, -1.6F);
  world.Trace();
  EXPECT_EQ(world.State(6.0, 0.05, -1.2), kNibbleMiss);
}

TEST(ColumnTracerTest, WhereAnythingWasMeasuredNothingIsMissed) {
  ColumnWorld world;
  world.FarWall(-1.7F, 2.0F);
  world.Hit(5.05F, 0.05F, 0.5F);      // a wire that rays pass on either side
  world.Ground(7.05F, 0.05F, -1.8F);  // ground in the lowest segment
  world.Trace();
  EXPECT_EQ(world.State(5.05, 0.05, 0.5), kNibbleHit);
  EXPECT_EQ(world.State(5.05, 0.05, -0.5), kNibbleMiss);
  EXPECT_EQ(world.State(7.05, 0.05, -1.2), 0);
  EXPECT_EQ(world.State(7.05, 0.05, -0.5), kNibbleMiss);
}

TEST(ColumnTracerTest, NearAnObstacleNothingIsMissedWithinTheBlur) {
  for (const float blur_m : {0.1F, 0.2F, 0.4F}) {
    ColumnOptions options;
    options.blur_m = blur_m;
    ColumnWorld world(options);
    world.FarWall(-1.7F, 2.0F);
    world.Hit(5.05F, 0.05F, 0.5F);
    world.Trace();
    for (int k = 1; k <= 8; ++k) {
      const bool is_near = 0.1 * k < double{blur_m} + 0.05;
      EXPECT_EQ(world.State(5.05 - 0.1 * k, 0.05, 0.5), is_near ? 0 : kNibbleMiss) << blur_m << k;
      EXPECT_EQ(world.State(5.05 + 0.1 * k, 0.05, 0.5), is_near ? 0 : kNibbleMiss) << blur_m << k;
      EXPECT_EQ(world.State(5.05 - 0.1 * k, 0.05, -0.5), kNibbleMiss);  // another segment
    }
  }
}

TEST(ColumnTracerTest, TheBlurOfAnObstacleAtTheEdgeStaysThere) {
  // The grid's last cell of one row is next to the first cell of the next row in memory only.
  ColumnWorld world;
  world.Hit(9.95F, 0.05F, 0.5F);
  for (const float z_m : testing::Steps(-1.7F, 2.0F, 0.01F)) {
    world.Hit(-12.0F, 0.18F, z_m);  // beyond the grid: its rays pass the grid's other edge
  }
  world.Trace();
  EXPECT_EQ(world.State(9.95, 0.05, 0.5), kNibbleHit);
  for (int k = 0; k < 6; ++k) {
    EXPECT_EQ(world.State(-9.85 + 0.1 * k, 0.15, 0.5), kNibbleMiss) << k;
  }
}

TEST(ColumnTracerTest, GroundReturnsClearAPlaceWithNothingBehindIt) {
  // A parked car has left: its place shows ground and sky.
  ColumnWorld world;
  for (const float x_m : testing::Steps(3.0F, 50.0F, 0.05F)) {
    world.Ground(x_m, 0.0F, -1.8F);
  }
  world.Trace();
  for (const double x : testing::Steps(3.5, 6.0, 0.1)) {
    EXPECT_EQ(world.State(x, 0.05, -0.5), kNibbleMiss) << x;
    EXPECT_EQ(world.State(x, 0.05, 0.5), 0) << x;
    EXPECT_EQ(world.State(x, 0.05, -1.5), 0) << x;  // ground was measured there
  }
}

TEST(ColumnTracerTest, TheVehiclesOwnPlaceIsFreeFromTheGroundToItsTop) {
  for (const float height_m : {0.1F, 0.25F, 0.5F, 1.0F, 2.0F}) {
    ColumnWorld world(WithSegments(16, height_m));
    world.FarWall(-1.7F, 1.0F);
    world.Hit(0.55F, 0.05F, -0.9F);  // something hanging from the vehicle
    world.Trace();
    const VehicleBody body;
    for (std::int32_t iy = -20; iy < 20; ++iy) {
      for (std::int32_t ix = -25; ix < 25; ++ix) {
        const double x = (ix + 0.5) * 0.1;
        const double y = (iy + 0.5) * 0.1;
        const bool is_body =
            std::abs(x) < double{body.half_length_m} && std::abs(y) < double{body.half_width_m};
        for (int k = 0; k < 16; ++k) {
          const double z = (world.AnchorOf(ix, iy) + k + 0.5) * double{height_m};
          const bool is_below_top = z + 0.4 * double{height_m} < double{body.clearance_m};
          EXPECT_EQ(world.State(x, y, z) == kNibbleFree, is_body && is_below_top)
              << height_m << ": " << x << " " << y << " " << z;
        }
      }
    }
  }
}

// Five metres behind it, on the same plain but for what poses and the road's roughness make of it.
TEST(ColumnTracerTest, WhereTheVehicleStoodBeforeTheSameSegmentsAreFree) {
  for (const float higher_m : {-0.2F, -0.001F, 0.001F, 0.2F}) {
    ColumnWorld world;
    world.Hit(-5.05F, 0.05F, -0.9F);  // a cyclist follows
    world.Hit(-5.05F, 0.05F, 0.2F);   // and his head
    world.Trail({.sensor_m = {-5.0F, 0.0F, higher_m}});
    world.Trace();
    for (const double x : {-6.45, -5.05, -3.55, -1.45, 0.05, 1.45}) {
      for (const double z : {-1.5, -0.5}) {
        EXPECT_EQ(world.State(x, 0.05, z), kNibbleFree) << higher_m << ": " << x << " " << z;
      }
      EXPECT_EQ(world.State(x, 0.05, 0.5), kNibbleOver) << higher_m << ": " << x;
      EXPECT_NE(world.State(x, 0.05, 1.5), kNibbleOver) << higher_m << ": " << x;
    }
    EXPECT_NE(world.State(-7.0, 0.05, -0.5), kNibbleFree) << higher_m;
  }
}

TEST(ColumnTracerTest, TheVehiclesBodyIsNoLargerThanTheGrid) {
  ColumnOptions options;
  options.body = {50.0F, 50.0F};
  ColumnWorld world(options, 8);
  world.Trace();
  for (const std::uint64_t column : world.result().columns) {
    EXPECT_EQ(column & 0xF, kNibbleFree);
  }
}

TEST(ColumnTracerTest, CellsWithoutGroundHaveNoColumn) {
  ColumnWorld world;
  world.FarWall(-1.7F, 2.0F);
  for (const double x : {0.05, 6.05, 9.05}) {
    world.cells()[world.grid().Index(ColumnWorld::CellOf(x), 0)] = KeyframeCell();
  }
  world.Trace();
  for (const double x : {0.05, 6.05, 9.05}) {
    EXPECT_EQ(world.result().columns[world.grid().Index(ColumnWorld::CellOf(x), 0)], 0U) << x;
  }
  EXPECT_EQ(world.State(5.95, 0.05, 0.5), kNibbleMiss);
}

}  // namespace
}  // namespace atlas
