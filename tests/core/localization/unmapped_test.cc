// Vehicles that drive off the map: what they find there may look like what was mapped.
#include <memory>
#include <numbers>
#include <utility>

#include <gtest/gtest.h>

#include "core/localization/localizer.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::PaintedMap;
using testing::ShapeWorld;
using testing::UprightPose;

// Of two yards that look the same the map has the first.
PaintedMap FirstYard() {
  ShapeWorld mapped = testing::TwoYards();
  mapped.patches.front().high.x() = -4.0;
  std::erase_if(mapped.boxes, [](const testing::Box& box) { return box.low.x() > 0.0; });
  PaintedMap map;
  map.Paint(mapped, 38.0);
  return map;
}

LocalizerOptions NearOptions() {
  LocalizerOptions options = testing::QuickOptions();
  options.features.max_range_m = 15.0F;
  return options;
}

Localizer LocalizerIn(const PaintedMap& map) {
  RelocalizerOptions options;
  options.features = NearOptions().features;
  auto relocalizer = std::make_shared<const Relocalizer>(map.profile(), testing::PlacesOf(map),
                                                         map.Source(), options);
  return {map.profile(), map.Source(), NearOptions(),
          [relocalizer]() -> Result<std::shared_ptr<const Relocalizer>> {
            return relocalizer;
          }};
}

// Whoever takes the second yard for standing while it is moved errs by as much.
ShapeWorld WithSecondYardMovedBy(const Eigen::Vector2d& moved_m) {
  ShapeWorld world = testing::TwoYards();
  for (testing::Box& box : world.boxes) {
    if (box.low.x() > 0.0) {
      box.low.head<2>() += moved_m;
      box.high.head<2>() += moved_m;
    }
  }
  return world;
}

LocalizationResult At(Localizer& localizer, const ShapeWorld& world, const Pose& truth) {
  return localizer
      .Localize(CastLeveledScan(testing::QuickSensor(), world, truth),
                Eigen::Quaterniond::Identity())
      .value();
}

Pose InYards(double x_m, double yaw_rad = 0.0) {
  return UprightPose({x_m, 0.5, 1.8}, yaw_rad);
}

class UnmappedTest : public ::testing::Test {
 protected:
  void Drive(double from_m, double to_m, double step_m, double yaw_rad = 0.0) {
    for (double x = from_m; (to_m - x) * step_m >= 0.0; x += step_m) {
      const Pose truth = InYards(x, yaw_rad);
      last_ = At(localizer_, WithSecondYardMovedBy(moved_m_), truth);
      off_m_ = ErrorOf(last_.T_world_sensor, truth).horizontal_m;
      EXPECT_FALSE(last_.health == LocalizationHealth::kGood && off_m_ > 0.3)
          << x << ": " << off_m_;
    }
  }

  // Where of the yards only the second is seen.
  void DriftBy(const Eigen::Vector2d& drift_m) {
    for (int step = 1; step <= 8; ++step) {
      moved_m_ = drift_m * (step / 8.0);
      Drive(16.0 + step, 16.0 + step, 1.0);
    }
  }

  const PaintedMap map_ = FirstYard();
  Localizer localizer_ = LocalizerIn(map_);
  LocalizationResult last_;
  double off_m_ = 0.0;
  Eigen::Vector2d moved_m_ = Eigen::Vector2d::Zero();
};

TEST_F(UnmappedTest, WhoWasKnownIsCarriedOnByHisOwnMotion) {
  localizer_.Start(InYards(-26.0));
  Drive(-26.0, -16.0, 1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kGood);
  Drive(-15.0, 26.0, 1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kLost) << "it is in the yard that was not mapped";
  EXPECT_LT(off_m_, 0.5);
  const Eigen::Vector4d off = PoseDifference(InYards(26.0), last_.T_world_sensor);
  EXPECT_LT(off.dot(last_.covariance.inverse() * off), 16.0) << "of four expected";
}

TEST_F(UnmappedTest, BackOnTheMapItIsFoundWhereItCameTo) {
  localizer_.Start(InYards(-26.0));
  Drive(-26.0, 24.0, 1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kLost);
  Drive(24.0, -20.0, -1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kGood);
  EXPECT_LT(off_m_, 0.06);
}

// As a car park's lift or a driver knows it.
PoseCovariance WithinAMetre() {
  return Eigen::Vector4d(0.3, 0.3, 0.3, 0.05).cwiseAbs2().asDiagonal();
}

TEST_F(UnmappedTest, WhoIsToldWhereHeStartsIsCarriedOnFromThere) {
  Pose told = InYards(24.0);
  told.translation() += Eigen::Vector3d(0.2, -0.1, 0.1);
  localizer_.Start(told, WithinAMetre());
  Drive(24.0, 4.0, -1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kLost);
  EXPECT_LT(off_m_, 0.5);
  const Eigen::Vector4d off = PoseDifference(InYards(4.0), last_.T_world_sensor);
  EXPECT_LT(off.dot(last_.covariance.inverse() * off), 16.0) << "of four expected";
  Drive(3.0, -26.0, -1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kGood);
  EXPECT_LT(off_m_, 0.06);
}

TEST_F(UnmappedTest, WhoIsToldWhereHeStartsOnTheMapIsKnownAtOnce) {
  Pose told = InYards(-22.0);
  told.translation() += Eigen::Vector3d(0.3, 0.3, -0.2);
  localizer_.Start(told, WithinAMetre());
  Drive(-22.0, -22.0, 1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kGood);
  EXPECT_LT(off_m_, 0.1);
}

// The deck below was mapped, and looks just like the one that it is on.
TEST(ToldHeightTest, ADeckThatWasNotMappedIsNotTakenForTheOneBelow) {
  const PaintedMap& map = testing::GarageMap();
  Localizer localizer = LocalizerIn(map);
  const Pose below = UprightPose({0.5, 2.0, 1.8}, 0.7);
  const LeveledScan scan = CastLeveledScan(testing::QuickSensor(), testing::GarageCorner(), below);
  Pose told = below;
  told.translation().z() += 6.0;
  localizer.Start(told,
                  PoseCovariance(Eigen::Vector4d(0.5, 0.5, 0.7, 0.05).cwiseAbs2().asDiagonal()));
  for (int i = 0; i < 5; ++i) {
    const LocalizationResult result =
        localizer.Localize(scan, Eigen::Quaterniond::Identity()).value();
    EXPECT_EQ(result.health, LocalizationHealth::kLost) << i;
    EXPECT_NEAR(result.T_world_sensor.translation().z(), told.translation().z(), 0.1) << i;
  }
  told.translation().z() = below.translation().z() - 1.2;
  localizer.Start(told,
                  PoseCovariance(Eigen::Vector4d(0.5, 0.5, 0.7, 0.05).cwiseAbs2().asDiagonal()));
  const LocalizationResult found = localizer.Localize(scan, Eigen::Quaterniond::Identity()).value();
  EXPECT_EQ(found.health, LocalizationHealth::kWeak) << "it was told something else";
  EXPECT_LT(ErrorOf(found.T_world_sensor, below).vertical_m, 0.05);
}

class DriftTest : public UnmappedTest,
                  public ::testing::WithParamInterface<std::pair<double, double>> {};

// The way back is carried on from where it was taken to be.
TEST_P(DriftTest, WhoErredOffTheMapIsRightAgainOnIt) {
  const Eigen::Vector2d drift_m(GetParam().first, GetParam().second);
  localizer_.Start(InYards(-26.0));
  Drive(-26.0, 16.0, 1.0);
  DriftBy(drift_m);
  Drive(24.0, 6.0, -1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kLost);
  EXPECT_NEAR(off_m_, drift_m.norm(), 0.2) << "it was to be led astray";
  Drive(5.0, -26.0, -1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kGood);
  EXPECT_LT(off_m_, 0.06);
}

INSTANTIATE_TEST_SUITE_P(Metres,
                         DriftTest,
                         ::testing::Values(std::pair(0.3, 0.0),
                                           std::pair(0.0, -0.3),
                                           std::pair(-1.0, 0.0),
                                           std::pair(0.0, 1.0)));

// A break in its motion: it may be anywhere, and is looked for everywhere.
TEST_F(UnmappedTest, WhoIsMovedWhileHeIsOffTheMapIsFoundWhereHeIs) {
  localizer_.Start(InYards(-26.0));
  Drive(-26.0, 14.0, 1.0);
  EXPECT_EQ(last_.health, LocalizationHealth::kLost);
  Drive(-10.0, -26.0, -0.75, std::numbers::pi);
  EXPECT_EQ(last_.health, LocalizationHealth::kGood);
  EXPECT_LT(off_m_, 0.06);
}

}  // namespace
}  // namespace atlas
