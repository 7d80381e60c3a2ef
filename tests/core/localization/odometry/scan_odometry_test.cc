// How a vehicle moved, from its scans alone.
#include "core/localization/odometry/scan_odometry.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/localization/odometry/motion_model.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::kDegree;
using testing::ShapeWorld;
using testing::UprightPose;

ScanFeatures Seen(const ShapeWorld& world, const Pose& truth) {
  return ExtractFeatures(CastLeveledScan(testing::QuickSensor(), world, truth),
                         testing::QuickOptions().features);
}

// On the street's slope, in a slight bend.
Pose OnStreet(double x_m) {
  return UprightPose({x_m, 0.4 * std::sin(0.2 * x_m), 1.8 + 0.01 * x_m},
                     0.08 * std::cos(0.2 * x_m));
}

Pose Moved(const Pose& from, double x_m, double y_m, double z_m, double yaw_rad) {
  Pose moved = from;
  moved.translation() += Eigen::Vector3d(x_m, y_m, z_m);
  moved.linear() =
      Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() * from.linear();
  return moved;
}

// Of a step that is known to be about this.
PosePrior Sure(const Pose& expected) {
  return {expected, PoseCovariance::Zero()};
}

TEST(ScanOdometryTest, OneStepIsFoundFromAroundIt) {
  const ScanOdometryOptions options;
  RecentScans recent(options.scans);
  for (const double x : {-8.0, -7.0, -6.0})
    recent.Add(Seen(testing::Street(), OnStreet(x)), OnStreet(x));
  const Pose truth = OnStreet(-5.0);
  const ScanFeatures scan = Seen(testing::Street(), truth);
  for (const double off : {-1.0, 0.0, 1.0}) {
    const Pose start = Moved(truth, 0.6 * off, 0.3 * off, 0.05, -3.0 * kDegree * off);
    const ScanMotion motion = MotionSince(recent, scan, Sure(start), options);
    EXPECT_GT(motion.fit, options.min_fit) << off;
    EXPECT_LT(ErrorOf(motion.T_world_level, truth).horizontal_m, 0.06) << off;
    EXPECT_LT(ErrorOf(motion.T_world_level, truth).vertical_m, 0.03) << off;
    EXPECT_LT(ErrorOf(motion.T_world_level, truth).angle_rad, 0.4 * kDegree) << off;
  }
}

TEST(ScanOdometryTest, AlongAStreetItDriftsLittle) {
  const ScanOdometryOptions options;
  RecentScans recent(options.scans);
  Pose pose = OnStreet(-15.0);
  recent.Add(Seen(testing::Street(), pose), pose);
  Pose before = pose;
  Pose start = OnStreet(-14.0);
  for (int i = 1; i <= 30; ++i) {
    const ScanFeatures scan = Seen(testing::Street(), OnStreet(-15.0 + i));
    const ScanMotion motion = MotionSince(recent, scan, Sure(start), options);
    ASSERT_GT(motion.fit, options.min_fit) << i;
    before = pose;
    pose = motion.T_world_level;
    recent.Add(scan, pose);
    start = pose;
    start.translation() += pose.translation() - before.translation();
  }
  EXPECT_LT(ErrorOf(pose, OnStreet(15.0)).horizontal_m, 0.25);
  EXPECT_LT(ErrorOf(pose, OnStreet(15.0)).vertical_m, 0.15);
  EXPECT_LT(ErrorOf(pose, OnStreet(15.0)).angle_rad, 1.0 * kDegree);
}

// Between the first scan and the second nothing is known of the motion but how vehicles drive.
TEST(ScanOdometryTest, AFirstStepIsFoundHoweverFastItIs) {
  const ScanOdometryOptions options;
  const Pose first = OnStreet(-8.0);
  RecentScans recent(options.scans);
  recent.Add(Seen(testing::Street(), first), first);
  MotionModel motion{MotionOptions()};
  motion.Start(first);
  motion.Predict();
  for (const double step_m : {-0.5, 0.0, 0.7, 1.3, 2.0, 2.6}) {
    const Pose truth = OnStreet(-8.0 + step_m);
    const ScanMotion moved = MotionSince(recent, Seen(testing::Street(), truth),
                                         {first, motion.StepCovariance()}, options);
    EXPECT_GT(moved.fit, options.min_fit) << step_m;
    EXPECT_LT(ErrorOf(moved.T_world_level, truth).horizontal_m, 0.1) << step_m;
  }
}

// An aisle below a deck, with pillars on both sides: rings on the ceiling are around the sensor
// wherever it is.
ShapeWorld Aisle() {
  ShapeWorld world;
  world.patches.push_back({});
  world.patches.push_back({.z_m = 3.0, .surface = testing::Surface::kCeiling});
  for (const double side : {-1.0, 1.0}) {
    world.boxes.push_back({{-60.0, 9.0 * side - 0.1, 0.0}, {60.0, 9.0 * side + 0.1, 3.0}});
    for (const double x_m : {-17.0, -12.0, -6.5, -1.0, 5.0, 10.0, 16.0}) {
      const Eigen::Vector3d foot(x_m + 0.7 * side, 3.5 * side, 0.0);
      world.boxes.push_back(
          {foot - Eigen::Vector3d(0.3, 0.3, 0.0), foot + Eigen::Vector3d(0.3, 0.3, 3.0)});
    }
  }
  return world;
}

TEST(ScanOdometryTest, ACeilingDoesNotStandStill) {
  const ScanOdometryOptions options;
  const Pose first = UprightPose({-4.0, 0.0, 1.8}, 0.0);
  RecentScans recent(options.scans);
  recent.Add(Seen(Aisle(), first), first);
  MotionModel motion{MotionOptions()};
  motion.Start(first);
  motion.Predict();
  for (const double step_m : {0.7, 1.25, 2.0}) {
    for (const double turn_rad : {-0.3, 0.0, 0.2}) {
      const Pose truth = UprightPose(
          first.translation() + Eigen::Vector3d(step_m, 0.5 * step_m * turn_rad, 0.0), turn_rad);
      const ScanMotion moved =
          MotionSince(recent, Seen(Aisle(), truth), {first, motion.StepCovariance()}, options);
      EXPECT_GT(moved.fit, options.min_fit) << step_m << " " << turn_rad;
      EXPECT_LT(ErrorOf(moved.T_world_level, truth).horizontal_m, 0.1) << step_m << " " << turn_rad;
      EXPECT_LT(ErrorOf(moved.T_world_level, truth).angle_rad, kDegree)
          << step_m << " " << turn_rad;
    }
  }
}

TEST(ScanOdometryTest, WhoWasMovedElsewhereFitsNothing) {
  const ScanOdometryOptions options;
  RecentScans recent(options.scans);
  for (const double x : {-12.0, -11.0, -10.0})
    recent.Add(Seen(testing::Street(), OnStreet(x)), OnStreet(x));
  const ScanFeatures elsewhere =
      Seen(testing::Street(), Moved(OnStreet(9.0), 0.0, 1.0, 0.0, 0.5 * std::numbers::pi));
  EXPECT_LT(MotionSince(recent, elsewhere, Sure(OnStreet(-9.0)), options).fit, options.min_fit);
  const ScanFeatures in_a_garage =
      Seen(testing::GarageCorner(), UprightPose({-4.0, -1.0, 1.8}, 0.2));
  EXPECT_LT(MotionSince(recent, in_a_garage, Sure(OnStreet(-9.0)), options).fit, options.min_fit);
}

// Along two endless walls nothing tells how far it went.
TEST(ScanOdometryTest, BetweenWallsAStepIsUncertainAlongThem) {
  const ScanOdometryOptions options;
  RecentScans recent(options.scans);
  const auto at = [](double x_m) {
    return UprightPose({x_m, 0.0, 1.8}, 0.0);
  };
  for (const double x : {0.0, 1.0, 2.0}) recent.Add(Seen(testing::Corridor(), at(x)), at(x));
  const ScanMotion motion =
      MotionSince(recent, Seen(testing::Corridor(), at(3.0)), Sure(at(3.0)), options);
  EXPECT_GT(std::sqrt(motion.covariance(0, 0)), 0.1);
  EXPECT_LT(std::sqrt(motion.covariance(1, 1)), 0.04);
}

// ... and of a vehicle whose speed nobody knows each step along them fits as well.
TEST(ScanOdometryTest, BetweenWallsASpeedThatNobodyKnowsStaysUnknown) {
  const ScanOdometryOptions options;
  RecentScans recent(options.scans);
  const Pose first = UprightPose({0.0, 0.0, 1.8}, 0.0);
  recent.Add(Seen(testing::Corridor(), first), first);
  MotionModel motion{MotionOptions()};
  motion.Start(first);
  motion.Predict();
  const ScanFeatures scan = Seen(testing::Corridor(), Moved(first, 2.0, 0.0, 0.0, 0.0));
  const ScanMotion moved = MotionSince(recent, scan, {first, motion.StepCovariance()}, options);
  EXPECT_GT(std::sqrt(moved.covariance(0, 0)), 2.0);
  EXPECT_LT(std::sqrt(moved.covariance(1, 1)), 0.2);
}

// Rings on a plain are around the sensor wherever it is.
TEST(ScanOdometryTest, APlainDoesNotStandStill) {
  const ScanOdometryOptions options;
  ShapeWorld plain;
  plain.patches.push_back({});
  const Pose first = UprightPose({0.0, 0.0, 1.8}, 0.0);
  const Pose truth = Moved(first, 1.5, 0.0, 0.0, 0.0);
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0.0F, 0.02F);
  const auto seen = [&](const Pose& pose) {
    ScanFeatures scan = Seen(plain, pose);
    for (Eigen::Vector3f& p : scan.ground) p.z() += noise(random);
    return scan;
  };
  RecentScans recent(options.scans);
  recent.Add(seen(first), first);
  const ScanMotion moved = MotionSince(recent, seen(truth), Sure(truth), options);
  EXPECT_LT(ErrorOf(moved.T_world_level, truth).horizontal_m, 0.02);
  EXPECT_LT(ErrorOf(moved.T_world_level, truth).vertical_m, 0.02);
  EXPECT_GT(std::sqrt(moved.covariance(0, 0)), 2.0);
  EXPECT_LT(std::sqrt(moved.covariance(2, 2)), 0.05);
}

TEST(ScanOdometryTest, WhereNothingIsNearWhatIsFarTells) {
  const ScanOdometryOptions options;
  ShapeWorld world;
  world.patches.push_back({});
  for (const double bearing_rad : {0.3, 1.4, 2.2, 3.5, 4.4, 5.6}) {
    const Eigen::Vector3d foot(33.0 * std::cos(bearing_rad), 33.0 * std::sin(bearing_rad), 0.0);
    world.boxes.push_back(
        {foot - Eigen::Vector3d(2.0, 1.5, 0.0), foot + Eigen::Vector3d(2.0, 1.5, 6.0)});
  }
  FeatureOptions far = testing::QuickOptions().features;
  far.max_range_m = 60.0F;
  const auto seen = [&](const Pose& pose) {
    return ExtractFeatures(CastLeveledScan(testing::QuickSensor(), world, pose), far);
  };
  const Pose first = UprightPose({0.0, 0.0, 1.8}, 0.0);
  RecentScans recent(options.scans);
  recent.Add(seen(first), first);
  MotionModel motion{MotionOptions()};
  motion.Start(first);
  motion.Predict();
  for (const double step_m : {0.0, 1.0, 2.5}) {
    const Pose truth = Moved(first, step_m, 0.0, 0.0, 0.05 * step_m);
    const ScanMotion moved =
        MotionSince(recent, seen(truth), {first, motion.StepCovariance()}, options);
    EXPECT_GT(moved.fit, options.min_fit) << step_m;
    EXPECT_LT(ErrorOf(moved.T_world_level, truth).horizontal_m, 0.1) << step_m;
  }
}

TEST(RecentScansTest, TheOldestGoesFirst) {
  RecentScans recent(2);
  EXPECT_TRUE(recent.is_empty());
  ScanFeatures scan;
  for (const float x : {1.0F, 2.0F, 3.0F}) {
    scan.columns.assign(1, {x, 0.0F, 0.0F});
    scan.ground.assign(1, {0.0F, x, 0.0F});
    recent.Add(scan, UprightPose({10.0, 0.0, 0.0}, 0.0));
  }
  const std::vector<Eigen::Vector3f> columns = recent.Columns({5.0, 0.0, 0.0});
  ASSERT_EQ(columns.size(), 2U);
  EXPECT_FLOAT_EQ(columns[0].x() + columns[1].x(), 5.0F + 5.0F + 2.0F + 3.0F);
  EXPECT_EQ(recent.Ground({5.0, 0.0, 0.0}).size(), 2U);
  recent.Clear();
  EXPECT_TRUE(recent.is_empty());
  recent.Add(scan, Pose::Identity());
  EXPECT_EQ(recent.Columns(Eigen::Vector3d::Zero()).size(), 1U);
}

}  // namespace
}  // namespace atlas
