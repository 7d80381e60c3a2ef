// What holds of the columns of any scan, whatever the segments.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "core/column/column_tracer.h"
#include "tests/core/column/column_world.h"

namespace atlas {
namespace {

using testing::ColumnWorld;

struct Shape {
  int segments;
  float height_m;
};

constexpr std::array<Shape, 6> kShapes{
    {{16, 0.1F}, {8, 0.25F}, {16, 0.5F}, {8, 1.0F}, {4, 1.0F}, {2, 2.0F}}};

// Blobs of returns on a rolling ground, ground returns between them.
ColumnWorld RandomWorld(const Shape& shape, std::mt19937& random) {
  ColumnOptions options;
  options.segments = shape.segments;
  options.segment_height_m = shape.height_m;
  ColumnWorld world(options);
  const auto height = [](double x, double y) {
    return -1.8 + 0.3 * std::sin(0.4 * x + 0.3 * y);
  };
  world.SetGround(height);
  std::uniform_real_distribution<float> coordinate(-11.0F, 11.0F);
  std::uniform_real_distribution<float> spread(-0.3F, 0.3F);
  std::uniform_real_distribution<float> above(0.0F, 3.0F);
  for (int blob = 0; blob < 60; ++blob) {
    const float x = coordinate(random);
    const float y = coordinate(random);
    for (int i = 0; i < 30; ++i) {
      const float px = x + spread(random);
      const float py = y + spread(random);
      const auto ground_m = static_cast<float>(height(px, py));
      world.Hit(px, py, ground_m + above(random));
      world.Ground(coordinate(random), coordinate(random), ground_m);
    }
  }
  world.Trace();
  return world;
}

bool IsBody(double x, double y) {
  return std::abs(x) < 1.5 && std::abs(y) < 1.1;
}

template <typename Visit>
void ForEachSegment(const ColumnWorld& world, const Visit& visit) {
  const std::int32_t r = world.grid().radius_cells;
  for (std::int32_t iy = -r; iy < r; ++iy) {
    for (std::int32_t ix = -r; ix < r; ++ix) {
      const std::uint64_t column = world.result().columns[world.grid().Index(ix, iy)];
      for (int k = 0; k < world.options().segments; ++k) {
        visit(ix, iy, world.AnchorOf(ix, iy) + k, NibbleAt(column, k));
      }
    }
  }
}

TEST(ColumnPropertyTest, NothingButHitMissFreeOverAndUnknownIsSaid) {
  std::mt19937 random(91);
  for (const Shape& shape : kShapes) {
    const ColumnWorld world = RandomWorld(shape, random);
    std::set<int> states;
    ForEachSegment(world,
                   [&](std::int32_t, std::int32_t, int, int state) { states.insert(state); });
    const bool is_over_said = states.erase(kNibbleOver) > 0;
    EXPECT_EQ(states, (std::set<int>{0, kNibbleFree, kNibbleMiss, kNibbleHit})) << shape.height_m;
    const float reach_m = static_cast<float>(shape.segments) * shape.height_m;
    if (reach_m < 1.7F || reach_m > 3.0F) {  // columns end below the sensor, or above
      EXPECT_EQ(is_over_said, reach_m > 3.0F) << shape.height_m;
    }
  }
}

TEST(ColumnPropertyTest, ASegmentInWhichAnythingWasMeasuredIsNeverMissed) {
  std::mt19937 random(92);
  for (const Shape& shape : kShapes) {
    ColumnWorld world = RandomWorld(shape, random);
    const LeveledScan& scan = world.scan();
    int hits = 0;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (scan.range_m[i] >= 10.0F || IsBody(double{scan.x[i]}, double{scan.y[i]})) {
        continue;
      }
      const int state = world.State(double{scan.x[i]}, double{scan.y[i]}, double{scan.z[i]});
      ASSERT_NE(state, kNibbleMiss) << shape.height_m;
      hits += state == kNibbleHit ? 1 : 0;
    }
    EXPECT_GT(hits, 100);
  }
}

TEST(ColumnPropertyTest, AHitIsAnObstacleReturnAboveTheBaseOffset) {
  std::mt19937 random(93);
  for (const Shape& shape : kShapes) {
    ColumnWorld world = RandomWorld(shape, random);
    const LeveledScan& scan = world.scan();
    std::set<std::tuple<std::int32_t, std::int32_t, int>> expected;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const std::int32_t ix = ColumnWorld::CellOf(double{scan.x[i]});
      const std::int32_t iy = ColumnWorld::CellOf(double{scan.y[i]});
      if (world.grid().Contains(ix, iy) && scan.range_m[i] < 10.0F && scan.is_ground[i] == 0 &&
          scan.z[i] - 1e-3F * static_cast<float>(
                                  world.cells()[world.grid().Index(ix, iy)].altitude_mm) >
              0.2999F) {
        expected.emplace(ix, iy, static_cast<int>(std::floor(scan.z[i] / shape.height_m)));
      }
    }
    int hits = 0;
    ForEachSegment(world, [&](std::int32_t ix, std::int32_t iy, int segment, int state) {
      hits += state == kNibbleHit ? 1 : 0;
      ASSERT_TRUE(state != kNibbleHit || expected.count({ix, iy, segment}) == 1)
          << shape.height_m << ": " << ix << " " << iy << " " << segment;
    });
    EXPECT_GT(hits, 100);
  }
}

TEST(ColumnPropertyTest, WhatIsMissedWasPassedByARay) {
  // Every ray sampled each centimetre: a missed segment has samples in its upper half, in its cell
  // or one beside it (a step's cell is that below its middle).
  std::mt19937 random(94);
  for (const Shape& shape : kShapes) {
    ColumnWorld world = RandomWorld(shape, random);
    const LeveledScan& scan = world.scan();
    std::set<std::tuple<std::int32_t, std::int32_t, int>> passed;
    const float half_m = 0.5F * shape.height_m;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      for (const float r : testing::Steps(0.0F, std::min(scan.range_m[i], 10.0F), 0.02F)) {
        const float t = r / scan.range_m[i];
        passed.emplace(ColumnWorld::CellOf(double{t * scan.x[i]}),
                       ColumnWorld::CellOf(double{t * scan.y[i]}),
                       static_cast<int>(std::floor(t * scan.z[i] / half_m)));
      }
    }
    int misses = 0;
    ForEachSegment(world, [&](std::int32_t ix, std::int32_t iy, int segment, int state) {
      if (state != kNibbleMiss) {
        return;
      }
      ++misses;
      bool is_passed = false;
      for (std::int32_t k = 0; k < 9; ++k) {
        is_passed |= passed.count({ix + k % 3 - 1, iy + k / 3 - 1, 2 * segment + 1}) == 1;
      }
      ASSERT_TRUE(is_passed) << shape.height_m << ": " << ix << " " << iy << " " << segment;
    });
    EXPECT_GT(misses, 50) << shape.height_m;
  }
}

TEST(ColumnPropertyTest, WithinTheBlurOfAHitNothingIsMissed) {
  std::mt19937 random(95);
  for (const Shape& shape : kShapes) {
    const ColumnWorld world = RandomWorld(shape, random);
    std::set<std::tuple<std::int32_t, std::int32_t, int>> hits;
    ForEachSegment(world, [&](std::int32_t ix, std::int32_t iy, int segment, int state) {
      if (state == kNibbleHit) {
        hits.emplace(ix, iy, segment);
      }
    });
    ForEachSegment(world, [&](std::int32_t ix, std::int32_t iy, int segment, int state) {
      for (std::int32_t k = 0; state == kNibbleMiss && k < 25; ++k) {
        ASSERT_EQ(hits.count({ix + k % 5 - 2, iy + k / 5 - 2, segment}), 0U);
      }
    });
  }
}

TEST(ColumnPropertyTest, TheOrderOfReturnsDoesNotMatter) {
  std::mt19937 random(96);
  for (const Shape& shape : kShapes) {
    ColumnWorld world = RandomWorld(shape, random);
    const LocalColumns first = world.result();
    LeveledScan& scan = world.scan();
    for (std::vector<float>* plane :
         {&scan.x, &scan.y, &scan.z, &scan.range_m, &scan.azimuth_rad}) {
      std::reverse(plane->begin(), plane->end());
    }
    std::reverse(scan.is_ground.begin(), scan.is_ground.end());
    world.Trace();
    EXPECT_EQ(world.result().columns, first.columns);
    EXPECT_EQ(world.result().anchors, first.anchors);
  }
}

TEST(ColumnPropertyTest, GridsOfAFewCellsWork) {
  for (const std::int32_t radius : {1, 2, 3, 9}) {
    ColumnWorld world({}, radius);
    world.FarWall(-1.7F, 2.0F);
    world.Hit(0.05F, 0.05F, -0.5F);
    world.Trace();
    EXPECT_EQ(world.result().columns.size(), world.grid().size());
  }
}

}  // namespace
}  // namespace atlas
