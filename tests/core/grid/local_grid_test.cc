// Whole grids: heights and occupancy of small worlds, and what holds of any scan.
#include "core/grid/local_grid.h"

#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/core/support/shape_world.h"

namespace atlas {
namespace {

using testing::AddReturn;
using testing::Box;
using testing::CastLeveledScan;
using testing::Patch;
using testing::Rings;
using testing::ShapeWorld;
using testing::SyntheticSensor;

constexpr float kHeight_m = 1.8F;

const SyntheticSensor kSensor{Rings(32, -24.8, 0.84), 1800};
const SyntheticSensor kUpwardSensor{Rings(32, -16.0, 1.0), 1800};

class LocalGridTest : public ::testing::Test {
 protected:
  LocalGrid Build(const ShapeWorld& world, const SyntheticSensor& sensor = kSensor) {
    return Build(CastLeveledScan(sensor, world, testing::UprightPose({0, 0, kHeight_m}, 0.0)));
  }

  LocalGrid Build(const LeveledScan& scan) {
    LocalGrid grid = BuildLocalGrid(scan, rays_, contact_, trail_, options_);
    ExpectInvariants(grid);
    return grid;
  }

  static void ExpectInvariants(const LocalGrid& grid) {
    for (const KeyframeCell& cell : grid.cells) {
      if (cell.source == AltitudeSource::kNone) {
        ASSERT_EQ(cell, KeyframeCell());
      }
    }
  }

  std::size_t Index(double x_m, double y_m) const {
    return rays_.grid().Index(static_cast<std::int32_t>(std::floor(x_m / 0.1)),
                              static_cast<std::int32_t>(std::floor(y_m / 0.1)));
  }
  const KeyframeCell& At(const LocalGrid& grid, double x_m, double y_m) const {
    return grid.cells[Index(x_m, y_m)];
  }

  // Calls visit(cell, x, y) at the middle of every cell.
  template <typename Visit>
  void ForEach(const LocalGrid& grid, const Visit& visit) const {
    for (int iy = -200; iy < 200; ++iy) {
      for (int ix = -200; ix < 200; ++ix) {
        visit(grid.cells[rays_.grid().Index(ix, iy)], (ix + 0.5) * 0.1, (iy + 0.5) * 0.1);
      }
    }
  }

  static bool IsBelowVehicle(double x_m, double y_m) {
    return std::abs(x_m) < 1.5 && std::abs(y_m) < 1.1;
  }

  RayTable rays_{GridGeometry{100'000, 200}};
  VehicleContact contact_{Eigen::Vector3f::UnitZ(), kHeight_m};
  std::vector<VehiclePlace> trail_;
  ProfileOptions options_;
};

TEST_F(LocalGridTest, HeightsLieOnTheSlopeWhereverTheyComeFrom) {
  for (const Eigen::Vector2d& gradient :
       {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.15, 0.0), Eigen::Vector2d(-0.1, 0.12)}) {
    ShapeWorld world{{Patch{}}, {}};
    world.patches[0].gradient = gradient;
    contact_.normal = Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized().cast<float>();
    const LocalGrid grid = Build(world);
    std::set<AltitudeSource> sources;
    ForEach(grid, [&](const KeyframeCell& cell, double x, double y) {
      if (std::hypot(x, y) < 10.0) {
        sources.insert(cell.source);
        ASSERT_EQ(cell.occupancy, IsBelowVehicle(x, y) ? Occupancy::kDriven : Occupancy::kFree)
            << x << " " << y;
        // Half a cell off the middle, either way.
        const double slack_mm = 2.0 + 71.0 * gradient.norm();
        ASSERT_NEAR(cell.altitude_mm,
                    1000.0 * (world.patches[0].HeightAt(x, y) - double{kHeight_m}), slack_mm);
      }
    });
    EXPECT_EQ(sources,
              (std::set<AltitudeSource>{AltitudeSource::kMeasured, AltitudeSource::kInterpolated}));
  }
}

TEST_F(LocalGridTest, BetweenTwoReturnsTheGroundIsInterpolatedAndSaysSo) {
  LeveledScan scan;
  AddReturn(scan, {6.0F, 0.05F, -1.8F}, true);
  AddReturn(scan, {10.0F, 0.083F, -1.6F}, true);
  const LocalGrid grid = Build(scan);
  for (const double x : testing::Steps(6.15, 9.8, 0.1)) {
    const KeyframeCell& cell = At(grid, x, 0.05);
    EXPECT_EQ(cell.source, AltitudeSource::kInterpolated) << x;
    EXPECT_NEAR(cell.altitude_mm, -1800 + 50 * (x - 6.0), 8) << x;
    EXPECT_EQ(cell.occupancy, Occupancy::kFree) << x;
  }
  EXPECT_EQ(At(grid, 6.02, 0.05).source, AltitudeSource::kMeasured);
  EXPECT_EQ(At(grid, 6.02, 0.05).altitude_mm, -1800);
  EXPECT_EQ(At(grid, 10.02, 0.05).altitude_mm, -1600);
  EXPECT_EQ(At(grid, 10.35, 0.05).source, AltitudeSource::kNone);
  EXPECT_EQ(At(grid, 8.0, 0.55).source, AltitudeSource::kNone);  // no ray there
}

TEST_F(LocalGridTest, AcrossAHoleTheGroundIsAGuess) {
  LeveledScan scan;
  AddReturn(scan, {6.0F, 0.05F, -1.8F}, true);
  AddReturn(scan, {10.0F, 0.083F, -1.8F}, true);
  AddReturn(scan, {8.0F, 0.066F, -2.3F}, true);  // the floor below, past the near edge
  const LocalGrid grid = Build(scan);
  EXPECT_EQ(At(grid, 5.0, 0.05).source, AltitudeSource::kInterpolated);
  for (const double x : testing::Steps(8.15, 9.8, 0.1)) {
    EXPECT_EQ(At(grid, x, 0.06).source, AltitudeSource::kExtrapolated) << x;
  }
  EXPECT_EQ(At(grid, 10.02, 0.05).source, AltitudeSource::kMeasured);
}

TEST_F(LocalGridTest, ACarsRoofIsNoGroundAndAnotherDeckIs) {
  LeveledScan scan;
  AddReturn(scan, {5.0F, 0.05F, -1.8F}, true);
  AddReturn(scan, {8.05F, 0.0805F, -0.1F}, true);  // 1.7 m above the road
  AddReturn(scan, {12.05F, 0.1205F, 1.6F}, true);  // 3.4 m above it
  AddReturn(scan, {16.05F, 0.1605F, -7.5F}, true);
  const LocalGrid grid = Build(scan);
  EXPECT_NE(At(grid, 8.05, 0.08).source, AltitudeSource::kMeasured);
  EXPECT_EQ(At(grid, 12.05, 0.12).source, AltitudeSource::kMeasured);
  EXPECT_EQ(At(grid, 12.05, 0.12).altitude_mm, 1600);
  EXPECT_EQ(At(grid, 16.05, 0.16).source, AltitudeSource::kMeasured);
  EXPECT_EQ(At(grid, 16.05, 0.16).altitude_mm, -7500);
}

TEST_F(LocalGridTest, BehindAnObstacleTheLastGroundIsExtrapolatedAndUnknown) {
  LeveledScan scan;
  AddReturn(scan, {6.0F, 0.05F, -1.8F}, true);
  AddReturn(scan, {8.05F, 0.06F, -0.8F}, false);
  AddReturn(scan, {12.0F, 0.083F, 2.0F}, false);  // the wall behind, seen above the obstacle
  const LocalGrid grid = Build(scan);
  EXPECT_EQ(At(grid, 7.0, 0.05).occupancy, Occupancy::kFree);
  EXPECT_EQ(At(grid, 8.05, 0.05).occupancy, Occupancy::kObstacle);
  for (const double x : testing::Steps(8.25, 11.9, 0.1)) {
    const KeyframeCell& cell = At(grid, x, 0.07);
    EXPECT_EQ(cell.source, AltitudeSource::kExtrapolated) << x;
    EXPECT_EQ(cell.occupancy, Occupancy::kUnknown) << x;
    EXPECT_EQ(cell.altitude_mm, -1800) << x;
  }
  EXPECT_EQ(At(grid, 12.35, 0.05).source, AltitudeSource::kNone);
}

TEST_F(LocalGridTest, WhatIsSeenToStandBehindAnObstacleIsOne) {
  // A car's side, its bonnet taken for ground, its windscreen; a wall seen above it, as high as a
  // vehicle and higher; a kerb behind.
  LeveledScan scan;
  AddReturn(scan, {6.0F, 0.05F, -1.8F}, true);
  AddReturn(scan, {8.05F, 0.0705F, -1.2F}, false);
  AddReturn(scan, {8.45F, 0.0745F, -0.9F}, true);
  AddReturn(scan, {9.05F, 0.0805F, -0.7F}, false);
  AddReturn(scan, {12.05F, 0.1105F, 0.6F}, false);
  AddReturn(scan, {14.05F, 0.1305F, 0.9F}, false);
  AddReturn(scan, {16.05F, 0.1505F, -1.6F}, false);
  const LocalGrid grid = Build(scan);
  for (const auto& [x, y] : {std::pair(8.05, 0.07), {8.45, 0.07}, {9.05, 0.08}, {12.05, 0.11}}) {
    const KeyframeCell& cell = At(grid, x, y);
    EXPECT_EQ(cell.occupancy, Occupancy::kObstacle) << x;
    EXPECT_EQ(cell.source, AltitudeSource::kExtrapolated) << x;
    EXPECT_EQ(cell.altitude_mm, -1800) << x;
  }
  EXPECT_EQ(At(grid, 10.05, 0.09).occupancy, Occupancy::kUnknown);
  EXPECT_EQ(At(grid, 14.05, 0.13).occupancy, Occupancy::kUnknown);
  EXPECT_EQ(At(grid, 16.05, 0.15).occupancy, Occupancy::kUnknown);
}

TEST_F(LocalGridTest, AParapetTakenForGroundIsAnObstacleAndTheLawnBehindIsGround) {
  LeveledScan scan;
  AddReturn(scan, {4.0F, 0.04F, -1.8F}, true);
  AddReturn(scan, {5.05F, 0.0505F, -0.8F}, true);
  AddReturn(scan, {5.15F, 0.0515F, -0.8F}, true);
  AddReturn(scan, {11.05F, 0.1105F, -1.7F}, true);  // 0.1 m up
  const LocalGrid grid = Build(scan);
  EXPECT_EQ(At(grid, 4.55, 0.05).occupancy, Occupancy::kFree);
  EXPECT_EQ(At(grid, 5.05, 0.05).occupancy, Occupancy::kObstacle);
  EXPECT_EQ(At(grid, 5.15, 0.05).occupancy, Occupancy::kObstacle);
  EXPECT_NE(At(grid, 5.05, 0.05).source, AltitudeSource::kMeasured);
  EXPECT_EQ(At(grid, 11.05, 0.11).source, AltitudeSource::kMeasured);
  EXPECT_EQ(At(grid, 11.05, 0.11).altitude_mm, -1700);
}

TEST_F(LocalGridTest, GroundMeasuredBehindAnObstacleIsKnownButNotFree) {
  LeveledScan scan;
  AddReturn(scan, {8.05F, 0.06F, -1.0F}, false);
  AddReturn(scan, {12.02F, 0.083F, -1.7F}, true);
  const LocalGrid grid = Build(scan);
  EXPECT_EQ(At(grid, 12.05, 0.05).source, AltitudeSource::kMeasured);
  EXPECT_EQ(At(grid, 12.05, 0.05).altitude_mm, -1700);
  EXPECT_EQ(At(grid, 12.05, 0.05).occupancy, Occupancy::kUnknown);
  EXPECT_EQ(At(grid, 10.05, 0.07).source, AltitudeSource::kExtrapolated);
  EXPECT_EQ(At(grid, 10.05, 0.07).occupancy, Occupancy::kUnknown);
}

TEST_F(LocalGridTest, AHitStaysAHitWhereOtherRaysPass) {
  // A post of one return, rays with ground far behind it on either side.
  LeveledScan scan;
  AddReturn(scan, {5.05F, 0.05F, -1.0F}, false);
  for (const float azimuth_rad : testing::Steps(-0.06F, 0.08F, 0.5F * rays_.ray_width_rad())) {
    if (rays_.Ray(azimuth_rad < 0 ? azimuth_rad + 6.2831853F : azimuth_rad) != rays_.Ray(0.0099F)) {
      AddReturn(scan, {15.0F * std::cos(azimuth_rad), 15.0F * std::sin(azimuth_rad), -1.8F}, true);
    }
  }
  const LocalGrid grid = Build(scan);
  EXPECT_EQ(At(grid, 5.05, 0.05).occupancy, Occupancy::kObstacle);
  EXPECT_EQ(At(grid, 5.05, 0.15).occupancy, Occupancy::kFree);
  EXPECT_EQ(At(grid, 5.05, -0.05).occupancy, Occupancy::kFree);
}

class AnyScanTest : public LocalGridTest {
 protected:
  static LeveledScan RandomScan(std::mt19937& random) {
    std::uniform_real_distribution<float> coordinate(-21.0F, 21.0F);
    LeveledScan scan;
    for (int i = 0; i < 3000; ++i) {
      const bool is_ground = random() % 3 != 0;
      AddReturn(scan,
                {coordinate(random), coordinate(random),
                 is_ground ? -1.8F : -1.5F + 0.001F * static_cast<float>(random() % 5000)},
                is_ground);
    }
    scan.column_spacing_rad = 0.005F;
    return scan;
  }

  // Up to where the ray ends its cells are free; where it ends at an obstacle is a hit.
  void Follow(int ray,
              const RayProfile& profile,
              std::vector<Occupancy>& cells,
              std::set<std::uint32_t>& hits) const {
    for (int step = 0; step < rays_.steps(); ++step) {
      const float begin_m = static_cast<float>(step) * rays_.step_m();
      const float end_m = begin_m + rays_.step_m();
      const std::uint32_t cell = rays_.Cells(ray)[step];
      if (profile.end.is_obstacle && profile.end.range_m >= begin_m &&
          profile.end.range_m < end_m) {
        hits.insert(cell);
      } else if (end_m <= profile.end.range_m) {
        cells[cell] = Occupancy::kFree;
      }
    }
  }

  // Whether the return is of something that stands, behind the end of its ray.
  bool StandsBehind(const LeveledScan& scan, std::size_t i, const RayProfile& profile) const {
    const float height_m = scan.z[i] - profile.GroundAt(scan.range_m[i]);
    return scan.range_m[i] < rays_.radius_m() && scan.range_m[i] >= profile.end.range_m &&
           height_m > 0.25F && height_m <= 2.5F;
  }
};

TEST_F(AnyScanTest, EachCellIsWhatTheNearestEndsOfItsRaysSay) {
  // A cell is driven below the vehicle, else an obstacle if a ray ends in it at one or something is
  // seen to stand in it behind, else free if a ray passed it, else unknown.
  std::mt19937 random(81);
  for (int round = 0; round < 5; ++round) {
    const LeveledScan scan = RandomScan(random);
    const LocalGrid grid = Build(scan);
    const GroundProfiles profiles(scan, rays_, contact_, options_);
    std::vector<Occupancy> expected(grid.cells.size(), Occupancy::kUnknown);
    std::set<std::uint32_t> hits;
    for (int ray = 0; ray < rays_.rays(); ++ray) {
      Follow(ray, profiles.Ray(ray), expected, hits);
    }
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (StandsBehind(scan, i, profiles.Ray(rays_.Ray(scan.azimuth_rad[i])))) {
        hits.insert(static_cast<std::uint32_t>(Index(scan.x[i], scan.y[i])));
      }
    }
    for (const std::uint32_t cell : hits) {
      expected[cell] = Occupancy::kObstacle;
    }
    options_.body.ForEachCell(rays_.grid(), contact_.Place(),
                              [&](std::int32_t ix, std::int32_t iy, float, float) {
                                expected[rays_.grid().Index(ix, iy)] = Occupancy::kDriven;
                              });
    int different = 0;  // where float division and multiplication round a border apart
    for (std::size_t i = 0; i < expected.size(); ++i) {
      different += grid.cells[i].occupancy != expected[i] ? 1 : 0;
    }
    EXPECT_LE(different, 5);
    EXPECT_GT(hits.size(), 100U);
  }
}

TEST_F(LocalGridTest, AVehiclePassesBelowABridgeAndNotThroughAWall) {
  ShapeWorld world{{Patch{}}, {}};
  world.boxes = {Box{{6.0, -10.0, 2.6}, {9.0, 10.0, 4.0}},     // a bridge
                 Box{{-9.0, -10.0, 2.2}, {-6.0, 10.0, 4.0}}};  // too low for the vehicle
  const LocalGrid grid = Build(world, kUpwardSensor);
  for (const double x : testing::Steps(5.0, 12.0, 0.1)) {
    EXPECT_EQ(At(grid, x, 0.05).occupancy, Occupancy::kFree) << x;
  }
  EXPECT_EQ(At(grid, -5.5, 0.05).occupancy, Occupancy::kFree);
  EXPECT_EQ(At(grid, -7.0, 0.05).occupancy, Occupancy::kUnknown);
}

TEST_F(LocalGridTest, AWallIsALineOfObstaclesWithHardlyAHole) {
  ShapeWorld world{{Patch{}}, {}};
  world.boxes = {Box{{8.05, -30.0, 0.0}, {9.0, 30.0, 5.0}}};
  const LocalGrid grid = Build(world);
  int holes = 0;
  for (int iy = -80; iy < 80; ++iy) {
    const double y = (iy + 0.5) * 0.1;
    const auto is_obstacle = [&](double x) {
      return At(grid, x, y).occupancy == Occupancy::kObstacle;
    };
    holes += is_obstacle(8.05) || is_obstacle(7.95) || is_obstacle(8.15) ? 0 : 1;
    EXPECT_EQ(At(grid, 7.5, y).occupancy, Occupancy::kFree) << y;
    EXPECT_EQ(At(grid, 8.6, y).occupancy, Occupancy::kUnknown) << y;
  }
  EXPECT_LE(holes, 2);  // where a ray's step and the wall meet askew
}

TEST_F(LocalGridTest, TheVehicleStandsOnItsWheelsPlane) {
  for (const Eigen::Vector3f& normal : {Eigen::Vector3f(0, 0, 1), Eigen::Vector3f(-0.17F, 0, 0.98F),
                                        Eigen::Vector3f(0.1F, 0.2F, 0.97F)}) {
    contact_.normal = normal.normalized();
    const LocalGrid grid = Build(LeveledScan());
    ForEach(grid, [&](const KeyframeCell& cell, double x, double y) {
      if (std::hypot(x, y) < 1.35) {
        ASSERT_EQ(cell.source, AltitudeSource::kMeasured) << x << " " << y;
        ASSERT_EQ(cell.occupancy, IsBelowVehicle(x, y) ? Occupancy::kDriven : Occupancy::kFree);
        const float z_m = contact_.HeightAt(static_cast<float>(x), static_cast<float>(y));
        ASSERT_NEAR(cell.altitude_mm, 1000.0F * z_m, 15.0F);
      } else if (std::hypot(x, y) > 1.7) {
        ASSERT_EQ(cell.source, AltitudeSource::kNone) << x << " " << y;
      }
    });
  }
}

TEST_F(LocalGridTest, ReturnsAreAveragedInTheirCell) {
  LeveledScan scan;
  AddReturn(scan, {6.02F, 0.02F, -1.80F}, true);
  AddReturn(scan, {6.07F, 0.02F, -1.70F}, true);
  AddReturn(scan, {6.03F, 0.07F, -1.78F}, true);
  EXPECT_NEAR(At(Build(scan), 6.05, 0.05).altitude_mm, -1760, 1);
}

TEST_F(LocalGridTest, HoweverManyReturnsFallIntoACellTheirMeanIsTrue) {
  LeveledScan scan;
  for (int i = 0; i < 70'000; ++i) {  // more than 16 bits count
    AddReturn(scan, {6.05F, 0.05F, -1.8F}, true);
  }
  EXPECT_NEAR(At(Build(scan), 6.05, 0.05).altitude_mm, -1800, 5);
}

TEST_F(LocalGridTest, GroundOutOfReachOfItsNumbersIsNotSeen) {
  // 16-bit millimetres: within 32 m of the sensor.
  for (const float z_m : {-31.9F, -32.5F, 31.9F, 32.5F}) {
    contact_.sensor_height_m = -z_m;
    const LocalGrid grid = Build(LeveledScan());
    const KeyframeCell& cell = At(grid, 0.05, 0.05);
    EXPECT_EQ(cell.source != AltitudeSource::kNone, std::abs(z_m) < 32.0F) << z_m;
    EXPECT_EQ(cell.occupancy == Occupancy::kDriven, std::abs(z_m) < 32.0F) << z_m;
    if (std::abs(z_m) < 32.0F) {
      EXPECT_NEAR(cell.altitude_mm, 1000.0F * z_m, 1.0F);
    }
  }
}

TEST_F(LocalGridTest, ARoofTakenForGroundIsNoGround) {
  // What segmentation says of a level roof: the way there is too steep.
  ShapeWorld world{{Patch{}}, {}};
  world.boxes = {Box{{6.0, -1.0, 0.2}, {10.4, 0.8, 1.5}}};
  LeveledScan scan = CastLeveledScan(kSensor, world, testing::UprightPose({0, 0, kHeight_m}, 0.0));
  for (std::size_t i = 0; i < scan.size(); ++i) {
    scan.is_ground[i] = static_cast<std::uint8_t>(scan.is_ground[i] != 0 || scan.z[i] > -0.31F);
  }
  const LocalGrid grid = Build(scan);
  for (const double x : testing::Steps(6.25, 10.0, 0.1)) {
    EXPECT_NE(At(grid, x, 0.05).occupancy, Occupancy::kFree) << x;
  }
}

}  // namespace
}  // namespace atlas
