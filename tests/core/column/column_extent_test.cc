// Where columns stand and how far they reach: anchors, numbers and heights of segments.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/column/column_tracer.h"
#include "tests/core/column/column_world.h"

namespace atlas {
namespace {

using testing::ColumnWorld;
using testing::WithSegments;

TEST(ColumnExtentTest, AnchorsAreTheLowestGroundOfTheirBlock) {
  const auto height = [](double x, double y) {
    return -1.8 + 0.2 * x - 0.13 * y;
  };
  for (const double height_m : {0.1, 0.3, 1.0, 2.0}) {
    ColumnWorld world(WithSegments(8, static_cast<float>(height_m)));
    world.SetGround(height);
    world.cells()[world.grid().Index(10, 10)] = KeyframeCell();
    world.Trace();
    EXPECT_EQ(world.result().anchors.size(), 25U * 25U);
    for (std::int32_t iy = -100; iy < 100; iy += 8) {
      for (std::int32_t ix = -100; ix < 100; ix += 8) {
        std::int32_t lowest_mm = 32'767;
        for (std::int32_t k = 0; k < 64; ++k) {
          const KeyframeCell& cell = world.cells()[world.grid().Index(ix + k % 8, iy + k / 8)];
          if (cell.source != AltitudeSource::kNone) {
            lowest_mm = std::min<std::int32_t>(lowest_mm, cell.altitude_mm);
          }
        }
        EXPECT_EQ(world.AnchorOf(ix, iy),
                  static_cast<int>(std::floor(1e-3 * lowest_mm / height_m + 1e-6)));
      }
    }
  }
}

TEST(ColumnExtentTest, BlocksThatDoNotFillTheGridHaveAnAnchorToo) {
  ColumnWorld world({}, 50);  // 100 cells: 12 blocks and a half
  world.Hit(4.95F, 0.05F, 0.5F);
  world.Trace();
  EXPECT_EQ(world.result().anchors.size(), 13U * 13U);
  EXPECT_EQ(world.AnchorOf(49, 49), -2);
  EXPECT_EQ(world.State(4.95, 0.05, 0.5), kNibbleHit);
}

TEST(ColumnExtentTest, BlocksWithoutGroundHaveAnchorZero) {
  ColumnWorld world;
  world.cells().assign(world.cells().size(), KeyframeCell());
  world.FarWall(-1.7F, 2.0F);
  world.Trace();
  EXPECT_TRUE(std::all_of(world.result().anchors.begin(), world.result().anchors.end(),
                          [](std::int16_t anchor) { return anchor == 0; }));
  EXPECT_TRUE(std::all_of(world.result().columns.begin(), world.result().columns.end(),
                          [](std::uint64_t column) { return column == 0; }));
}

TEST(ColumnExtentTest, ColumnsHaveAsManySegmentsAsTheProfileSays) {
  for (const int segments : {2, 4, 8, 16}) {
    ColumnWorld world(WithSegments(segments, 0.5F));
    world.FarWall(-1.4F, 8.0F);  // seen from -2 to 8 m: 20 segments
    world.Trace();
    const std::uint64_t column =
        world.result().columns[world.grid().Index(ColumnWorld::CellOf(9.0), 0)];
    for (int k = 0; k < 16; ++k) {
      EXPECT_EQ(NibbleAt(column, k) != 0, k > 0 && k < segments) << segments << " " << k;
    }
    for (const std::uint64_t any : world.result().columns) {
      ASSERT_TRUE(segments == 16 || any >> (4 * (segments % 16)) == 0);
    }
  }
}

TEST(ColumnExtentTest, ReturnsFarAboveAndBelowAreLeftOutWithoutHarm) {
  for (const float height_m : {0.1F, 1.0F, 2.0F}) {
    ColumnWorld world(WithSegments(16, height_m));
    for (const float z_m : {-900.0F, -60.0F, 60.0F, 900.0F}) {
      world.Hit(5.05F, 0.05F, z_m);
      world.Ground(6.05F, 0.05F, z_m);
    }
    world.Hit(7.05F, 0.05F, -1.05F);
    world.Trace();
    EXPECT_EQ(world.State(7.05, 0.05, -1.05), kNibbleHit) << height_m;
    EXPECT_EQ(world.result().columns[world.grid().Index(50, 0)] & ~0x6666'6666'6666'6666ULL, 0U);
  }
}

TEST(ColumnExtentTest, ASensorHighAboveThinSegmentsStillClears) {
  // 3.2 m up, segments of 0.1 m: the bits end 2.4 m above its foot.
  ColumnWorld world(WithSegments(16, 0.1F));
  world.SetGround([](double, double) { return -3.2; });
  world.FarWall(-3.1F, 0.0F);
  world.Trace();
  EXPECT_EQ(world.State(8.05, 0.05, -2.05), kNibbleMiss);
  EXPECT_EQ(world.State(9.02, 0.05, -2.05), kNibbleHit);
}

TEST(ColumnExtentTest, OptionsComeFromTheProfile) {
  MapProfile profile;
  profile.column_segments = 4;
  profile.segment_height_mm = 500;
  profile.column_base_offset_mm = 450;
  const ColumnOptions options = ColumnOptions::FromProfile(profile, 8);
  EXPECT_EQ(options.segments, 4);
  EXPECT_FLOAT_EQ(options.segment_height_m, 0.5F);
  EXPECT_FLOAT_EQ(options.base_offset_m, 0.45F);
  EXPECT_EQ(options.block_cells, 8);
}

}  // namespace
}  // namespace atlas
