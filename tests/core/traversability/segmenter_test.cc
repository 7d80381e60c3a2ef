// Ground and obstacles in small worlds whose truth is known.
#include "core/traversability/segmenter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "tests/core/traversability/segmented_world.h"

namespace atlas {
namespace {

using testing::Box;
using testing::CastScan;
using testing::FlatWorld;
using testing::kDegree;
using testing::kHeight_m;
using testing::kSensors;
using testing::LayoutOf;
using testing::Patch;
using testing::Rings;
using testing::Score;
using testing::Segment;
using testing::Segmented;
using testing::SensorAt;
using testing::ShapeWorld;
using testing::Surface;
using testing::SyntheticSensor;
using testing::TruthScan;

TEST(SegmenterTest, FlatGroundIsGroundWhateverTheRings) {
  for (const SyntheticSensor& sensor : kSensors) {
    const TruthScan scan = CastScan(sensor, FlatWorld(), SensorAt(kHeight_m));
    const Score score = Segment(sensor, scan).CountWithin(Surface::kGround, 25.0F);
    EXPECT_GT(score.returns, 3000);
    EXPECT_EQ(score.ground, score.returns) << sensor.elevation_deg.size();
  }
}

TEST(SegmenterTest, SlopesUpToTwentyDegreesAreGround) {
  for (const SyntheticSensor& sensor : kSensors) {
    for (const double slope_deg : {5.0, 10.0, 15.0, 20.0}) {
      for (const double way : {0.0, 1.1, 3.0}) {
        const double rise = std::tan(slope_deg * kDegree);
        ShapeWorld world = FlatWorld();
        world.patches[0].gradient = {rise * std::cos(way), rise * std::sin(way)};
        const Score score = Segment(sensor, CastScan(sensor, world, SensorAt(kHeight_m)))
                                .CountWithin(Surface::kGround, 15.0F);
        EXPECT_GT(score.returns, 1000);
        EXPECT_GT(score.share(), 0.995)
            << slope_deg << " deg, " << sensor.elevation_deg.size() << " rings";
      }
    }
  }
}

TEST(SegmenterTest, SteeperThanAVehicleClimbsIsNoGround) {
  for (const SyntheticSensor& sensor : kSensors) {
    ShapeWorld world = FlatWorld();
    world.patches[0].gradient = {std::tan(27.0 * kDegree), 0.0};
    const TruthScan scan = CastScan(sensor, world, SensorAt(kHeight_m));
    EXPECT_LT(Segment(sensor, scan).Count(Surface::kGround).share(), 0.01);
  }
}

TEST(SegmenterTest, GravityDecidesAndNotTheSensorsOwnAxis) {
  // Flat ground seen from a sensor that is rolled and pitched, as a vehicle on a ramp is.
  for (const SyntheticSensor& sensor : kSensors) {
    for (const double tilt_deg : {-12.0, 8.0, 15.0}) {
      Pose T_world_sensor = SensorAt(kHeight_m);
      T_world_sensor.linear() =
          Eigen::AngleAxisd(tilt_deg * kDegree, Eigen::Vector3d(0.6, 0.8, 0.0)).toRotationMatrix();
      const TruthScan scan = CastScan(sensor, FlatWorld(), T_world_sensor);
      const Eigen::Vector3d up = T_world_sensor.linear().transpose() * Eigen::Vector3d::UnitZ();
      EXPECT_GT(Segment(sensor, scan, up).CountWithin(Surface::kGround, 15.0F).share(), 0.995);
    }
  }
}

TEST(SegmenterTest, WallsAreObstaclesAboveTheirFoot) {
  ShapeWorld world = FlatWorld();
  world.boxes = {Box{{10.0, -30.0, 0.0}, {11.0, 30.0, 8.0}},
                 Box{{-30.0, 6.0, 0.0}, {9.0, 7.0, 8.0}}};
  for (const SyntheticSensor& sensor : kSensors) {
    const Segmented result = Segment(sensor, CastScan(sensor, world, SensorAt(kHeight_m)));
    const Score above = result.Count(Surface::kWall, [](const Eigen::Vector3f& p) {
      return p.z() > -kHeight_m + 0.3;  // higher than the threshold about any plane at its foot
    });
    EXPECT_GT(above.returns, 1000);
    EXPECT_EQ(above.ground, 0) << sensor.elevation_deg.size();
    EXPECT_GT(result.CountWithin(Surface::kGround, 15.0F).share(), 0.97);
  }
}

TEST(SegmenterTest, CarsAreObstaclesBelowTheirRoofs) {
  // A level roof is ground to the windows over it; core/grid refuses what no vehicle climbs to.
  ShapeWorld world = FlatWorld();
  for (const double x : {-14.0, -7.0, 5.0, 11.0}) {
    world.boxes.push_back(Box{{x, 3.0, 0.2}, {x + 4.4, 4.8, 1.5}});
    world.boxes.push_back(Box{{x, -4.8, 0.2}, {x + 4.4, -3.0, 1.5}});
  }
  for (const SyntheticSensor& sensor : kSensors) {
    const Segmented result = Segment(sensor, CastScan(sensor, world, SensorAt(kHeight_m)));
    const Score sides = result.Count(Surface::kWall, [](const Eigen::Vector3f& p) {
      return p.z() > -kHeight_m + 0.3 && p.z() < -kHeight_m + 1.3;
    });
    EXPECT_GT(sides.returns, 500);
    EXPECT_LT(sides.share(), 0.01) << sensor.elevation_deg.size();
    EXPECT_GT(result.CountWithin(Surface::kGround, 15.0F).share(), 0.96);
  }
}

TEST(SegmenterTest, CeilingsAreNeverGround) {
  for (const SyntheticSensor& sensor :
       {SyntheticSensor{Rings(16, -15.0, 2.0), 900}, SyntheticSensor{Rings(64, -30.0, 1.0), 900}}) {
    for (const double slope_deg : {0.0, 4.0, 8.0}) {
      const Eigen::Vector2d gradient(std::tan(slope_deg * kDegree), 0.0);
      ShapeWorld world;
      world.patches = {Patch{0.0, gradient, Surface::kGround},
                       Patch{2.6, gradient, Surface::kCeiling}};
      const Segmented result = Segment(sensor, CastScan(sensor, world, SensorAt(kHeight_m)));
      EXPECT_GT(result.Count(Surface::kCeiling).returns, 1000);
      EXPECT_EQ(result.Count(Surface::kCeiling).ground, 0)
          << slope_deg << " deg, " << sensor.elevation_deg.size() << " rings";
      EXPECT_GT(result.CountWithin(Surface::kGround, 12.0F).share(), 0.99);
    }
  }
}

TEST(SegmenterTest, BothSidesOfAKerbAreGround) {
  ShapeWorld world;
  world.patches = {Patch{}, Patch{}};
  world.patches[0].high.y() = 3.0;
  world.patches[1].z_m = 0.14;
  world.patches[1].low.y() = 3.0;
  for (const SyntheticSensor& sensor : kSensors) {
    const Segmented result = Segment(sensor, CastScan(sensor, world, SensorAt(kHeight_m)));
    EXPECT_GT(result.CountWithin(Surface::kGround, 12.0F).share(), 0.97)
        << sensor.elevation_deg.size();
  }
}

TEST(SegmenterTest, LostReturnsDoNotMakeObstacles) {
  std::mt19937 random(51);
  for (const SyntheticSensor& sensor : kSensors) {
    const TruthScan full = CastScan(sensor, FlatWorld(), SensorAt(kHeight_m));
    TruthScan scan;
    for (std::size_t i = 0; i < full.cloud.size(); ++i) {
      const Eigen::Vector3f& p = full.cloud.points[i];
      const bool is_puddle = (p.head<2>() - Eigen::Vector2f(8.0F, 2.0F)).norm() < 2.0F;
      if (random() % 2 == 0 && !is_puddle) {
        scan.cloud.points.push_back(p);
        scan.truth.push_back(full.truth[i]);
      }
    }
    EXPECT_GT(Segment(sensor, scan).CountWithin(Surface::kGround, 15.0F).share(), 0.995)
        << sensor.elevation_deg.size();
  }
}

TEST(SegmenterTest, NoiseOfARealSensorIsStillGround) {
  std::mt19937 random(52);
  std::normal_distribution<float> noise(0.0F, 0.03F);
  TruthScan scan = CastScan(kSensors[0], FlatWorld(), SensorAt(kHeight_m));
  for (Eigen::Vector3f& p : scan.cloud.points) {
    p += p.normalized() * noise(random);
  }
  EXPECT_GT(Segment(kSensors[0], scan).CountWithin(Surface::kGround, 15.0F).share(), 0.99);
}

TEST(SegmenterTest, AScanOfOneRingHasNoGround) {
  for (const double elevation_deg : {-15.0, -1.0, 5.0}) {
    ShapeWorld world = FlatWorld();
    world.boxes = {Box{{10.0, -30.0, 0.0}, {11.0, 30.0, 8.0}}};
    const TruthScan scan = CastScan({{elevation_deg}, 900}, world, SensorAt(kHeight_m));
    ASSERT_GT(scan.cloud.size(), 0U);
    const Segmented result = Segment(kSensors[0], scan);
    EXPECT_EQ(std::count(result.is_ground.begin(), result.is_ground.end(), 1), 0);
  }
}

TEST(SegmenterTest, EmptyScansAndSensorsOfFewRingsAreFine) {
  EXPECT_TRUE(Segment(kSensors[0], TruthScan()).is_ground.empty());
  const TruthScan scan = CastScan(kSensors[0], FlatWorld(), SensorAt(kHeight_m));
  for (const int step : {5, 8, 16, 100}) {  // 4, 2, 1 and 1 rows: too few for a window from 2 on
    const RangeImage image = MakeRangeImage(scan.cloud, LayoutOf(kSensors[0]), step);
    const auto is_ground = Segmenter({}).Segment(image, Eigen::Vector3f::UnitZ());
    const auto ground = std::count(is_ground.begin(), is_ground.end(), 1);
    EXPECT_EQ(ground > 0, step == 5) << step;
  }
}

TEST(SegmenterTest, NotANumberNeverBecomesGround) {
  const TruthScan scan = CastScan(kSensors[0], FlatWorld(), SensorAt(kHeight_m));
  RangeImage image = MakeRangeImage(scan.cloud, LayoutOf(kSensors[0]), 1);
  for (std::size_t i = 0; i < image.size(); i += 10) {
    (i % 20 == 0 ? image.x : image.z)[i] = std::numeric_limits<float>::quiet_NaN();
  }
  const auto is_ground = Segmenter({}).Segment(image, Eigen::Vector3f::UnitZ());
  int others = 0;
  for (std::size_t i = 0; i < image.size(); ++i) {
    if (i % 10 == 0) {
      EXPECT_EQ(is_ground[i], 0);
    } else {
      others += is_ground[i];
    }
  }
  EXPECT_GT(others, static_cast<int>(image.size() * 8 / 10));
}

}  // namespace
}  // namespace atlas
