// How a sensor is mounted, found from the ground that it sees.
#include "core/keyframe/sensor_mount.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/keyframe/keyframe_builder.h"
#include "tests/core/support/shape_world.h"

namespace atlas {
namespace {

using testing::AddReturn;
using testing::kDegree;
using testing::ShapeWorld;
using testing::Vlp16;

// Ground z = z_m + slope x (levelled frame) from `first_m` to `last_m` ahead, 2 m wide.
LeveledScan Road(double z_m, double slope, double first_m, double last_m) {
  LeveledScan scan;
  for (const double x_m : testing::Steps(first_m, last_m, 0.1)) {
    for (const double y_m : testing::Steps(-1.0, 1.0, 0.2)) {
      AddReturn(scan, Eigen::Vector3d(x_m, y_m, z_m + slope * x_m).cast<float>(), true);
    }
  }
  return scan;
}

SensorMount MountOf(const LeveledScan& scan) {
  SensorMountEstimator estimator;
  estimator.Add(scan, Eigen::Quaterniond::Identity());
  return estimator.Estimate().value();
}

TEST(SensorMountTest, TheHeightOfASlopeSeenAheadOnlyIsThatBelowTheSensor) {
  const SensorMount mount = MountOf(Road(-1.42, 0.08, 4.0, 11.0));
  EXPECT_NEAR(mount.height_m, 1.42, 0.005);
  EXPECT_NEAR(mount.TiltDeg(), std::atan(0.08) / kDegree, 0.05);
}

// Of a VLP-16 upright but for `up` (sensor frame), `height_m` above the world's zero.
SensorMount MountIn(const ShapeWorld& world, double height_m, const Eigen::Vector3d& up) {
  Pose T_world_sensor = testing::UprightPose({0.0, 0.0, height_m}, 0.0);
  T_world_sensor.linear() *=
      Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const PointCloud cloud = testing::CastScan(Vlp16(), world, T_world_sensor).cloud;
  SensorLayoutEstimator layout;
  layout.Add(cloud);
  const Eigen::Quaterniond R_level_sensor =
      SplitYaw(Eigen::Quaterniond(T_world_sensor.linear())).R_level_sensor;
  SensorMountEstimator estimator;
  estimator.Add(SegmentScan(cloud, layout.Estimate().value(), 1, R_level_sensor, {}),
                R_level_sensor);
  return estimator.Estimate().value();
}

TEST(SensorMountTest, ATiltedSensorIsToldFromATiltedRoad) {
  ShapeWorld street;
  street.patches = {{0.0},
                    {0.12, {0.0, 0.0}, testing::Surface::kGround, {-100.0, -100.0}, {100.0, -2.5}}};
  const Eigen::Vector3d up(std::sin(-4.0 * kDegree), std::sin(6.0 * kDegree), 1.0);
  const SensorMount mount = MountIn(street, 2.1, up);
  EXPECT_NEAR(mount.height_m, 2.1, 0.01);
  EXPECT_LT(std::acos(mount.up.dot(up.normalized())) / kDegree, 0.3);
}

TEST(SensorMountTest, RoofsOfParkedCarsAreNotTheGroundOfALorry) {
  ShapeWorld street;
  street.patches = {{0.0},
                    {1.5, {0.0, 0.0}, testing::Surface::kGround, {-30.0, 2.2}, {30.0, 4.0}},
                    {1.5, {0.0, 0.0}, testing::Surface::kGround, {-30.0, -4.0}, {30.0, -2.2}}};
  for (const double height_m : {1.8, 2.5, 3.1, 3.8, 4.5}) {
    EXPECT_NEAR(MountIn(street, height_m, Eigen::Vector3d::UnitZ()).height_m, height_m, 0.03);
  }
}

TEST(SensorMountTest, AKerbAndTheFootOfARampAreLeftOut) {
  LeveledScan scan = Road(-1.8, 0.0, 3.0, 9.0);
  for (const double y_m : testing::Steps(1.0, 1.4, 0.1)) {
    for (const double x_m : testing::Steps(3.0, 9.0, 0.2)) {
      AddReturn(scan, Eigen::Vector3d(x_m, y_m, -1.65).cast<float>(), true);
    }
  }
  const SensorMount mount = MountOf(scan);
  EXPECT_NEAR(mount.height_m, 1.8, 0.01);
  EXPECT_LT(mount.TiltDeg(), 0.3);
}

TEST(SensorMountTest, FlatGroundIsBelievedRatherThanABend) {
  SensorMountEstimator estimator;
  for (int i = 0; i < 4; ++i) {
    LeveledScan bend = Road(-1.8, 0.0, -8.0, -3.0);
    const LeveledScan ramp = Road(-3.0, 0.3, 4.0, 9.0);
    for (std::size_t k = 0; k < ramp.size(); ++k) {
      AddReturn(bend, {ramp.x[k], ramp.y[k], ramp.z[k]}, true);
    }
    estimator.Add(bend, Eigen::Quaterniond::Identity());
    estimator.Add(Road(-1.8, 0.0, -8.0, 8.0), Eigen::Quaterniond::Identity());
  }
  const SensorMount mount = estimator.Estimate().value();
  EXPECT_NEAR(mount.height_m, 1.8, 0.001);
  EXPECT_LT(mount.TiltDeg(), 0.01);
}

TEST(SensorMountTest, WithoutGroundOrWithGroundAboveThereIsNone) {
  SensorMountEstimator estimator;
  EXPECT_EQ(estimator.Estimate().error().code(), StatusCode::kInvalidData);
  estimator.Add(Road(0.2, 0.0, 3.0, 9.0), Eigen::Quaterniond::Identity());
  EXPECT_EQ(estimator.Estimate().error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
