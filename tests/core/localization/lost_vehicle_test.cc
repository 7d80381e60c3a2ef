// Vehicles that are lost and looked for in the whole map: where places look alike, the scans of a
// short drive decide.
#include <cmath>
#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "core/localization/localizer.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::PaintedMap;
using testing::QuickOptions;
using testing::ShapeWorld;
using testing::StreetMap;
using testing::UprightPose;

Relocalizer RelocalizerIn(const PaintedMap& map, const LocalizerOptions& options) {
  RelocalizerOptions relocalizer;
  relocalizer.features = options.features;
  return {map.profile(), testing::PlacesOf(map), map.Source(), relocalizer};
}

Localizer LocalizerIn(const PaintedMap& map, const LocalizerOptions& options) {
  auto relocalizer = std::make_shared<const Relocalizer>(RelocalizerIn(map, options));
  return {map.profile(), map.Source(), options,
          [relocalizer]() -> Result<std::shared_ptr<const Relocalizer>> {
            return relocalizer;
          }};
}

LocalizationResult At(Localizer& localizer, const ShapeWorld& world, const Pose& truth) {
  return localizer
      .Localize(CastLeveledScan(testing::QuickSensor(), world, truth),
                Eigen::Quaterniond::Identity())
      .value();
}

Pose OnStreet(double x_m, double yaw_rad = 0.0) {
  return UprightPose({x_m, 0.0, 1.8 + 0.01 * x_m}, yaw_rad);
}

// Good or not, and never good elsewhere.
bool IsGood(const LocalizationResult& result, const Pose& truth) {
  if (result.health != LocalizationHealth::kGood) {
    return false;
  }
  EXPECT_LT(ErrorOf(result.T_world_sensor, truth).horizontal_m, 0.1)
      << truth.translation().transpose();
  EXPECT_LT(ErrorOf(result.T_world_sensor, truth).vertical_m, 0.1);
  return true;
}

TEST(LostVehicleTest, CarriedAwayAndTurnedItIsBackAfterSomeScans) {
  Localizer localizer = LocalizerIn(StreetMap(), QuickOptions());
  localizer.Start(OnStreet(-16.0));
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(IsGood(At(localizer, testing::Street(), OnStreet(-16.0 + 0.6 * i)),
                       OnStreet(-16.0 + 0.6 * i)));
  }
  int scans = 0;
  for (; scans < 12; ++scans) {
    const Pose truth = OnStreet(12.0 - 0.6 * scans, 0.5 * std::numbers::pi);
    if (IsGood(At(localizer, testing::Street(), truth), truth)) break;
  }
  EXPECT_GT(scans, 1) << "one scan is no proof";
  EXPECT_LE(scans, 7);
  const Pose last = OnStreet(12.0 - 0.6 * (scans + 1), 0.5 * std::numbers::pi);
  EXPECT_TRUE(IsGood(At(localizer, testing::Street(), last), last));
}

// The same yard twice, 40 m apart; what tells them apart comes into sight when it drives on.
TEST(LostVehicleTest, OfTwoPlacesThatLookAlikeItTakesTheOneThatItsDriveShows) {
  for (const double x : {-20.0, 20.0}) {
    ShapeWorld told_apart = testing::TwoYards();
    told_apart.boxes.push_back({{x + 11.05, 6.05, -1.0}, {x + 12.05, 13.05, 4.0}});
    PaintedMap map;
    map.Paint(told_apart, 38.0);
    LocalizerOptions options = QuickOptions();
    options.features.max_range_m = 15.0F;
    Localizer localizer = LocalizerIn(map, options);
    localizer.Start(UprightPose({0.0, -25.0, 1.8}, 0.0));
    int good = 0;
    for (int i = 0; i < 24; ++i) {
      const Pose truth = UprightPose({x - 6.0 + 0.4 * i, 0.5, 1.8}, 0.1);
      const bool is_good = IsGood(At(localizer, told_apart, truth), truth);
      EXPECT_FALSE(is_good && i < 3) << "it may be 40 m away";
      good += is_good ? 1 : 0;
    }
    EXPECT_GE(good, 5) << x;
  }
}

TEST(LostVehicleTest, WhatIsAlikeForGoodIsNeverGood) {
  const ShapeWorld world = testing::TwoYards();
  PaintedMap map;
  map.Paint(world, 38.0);
  LocalizerOptions options = QuickOptions();
  options.features.max_range_m = 15.0F;
  Localizer localizer = LocalizerIn(map, options);
  localizer.Start(UprightPose({0.0, -25.0, 1.8}, 0.0));
  for (int i = 0; i < 20; ++i) {
    const LocalizationResult result =
        At(localizer, world, UprightPose({-24.0 + 0.3 * i, 0.5, 1.8}, 0.1));
    EXPECT_NE(result.health, LocalizationHealth::kGood) << i;
    if (result.health == LocalizationHealth::kWeak) {
      EXPECT_GT(std::sqrt(result.covariance(0, 0)), 5.0) << i;
    }
  }
}

TEST(LostVehicleTest, InTheMapOfAnotherPlaceItStaysLost) {
  Localizer localizer = LocalizerIn(StreetMap(), QuickOptions());
  localizer.Start(OnStreet(0.0));
  for (int i = 0; i < 14; ++i) {
    const Pose elsewhere = UprightPose({-6.0 + 0.8 * i, -1.0, 1.8}, 0.2);
    const LocalizationResult result = At(localizer, testing::GarageCorner(), elsewhere);
    EXPECT_NE(result.health, LocalizationHealth::kGood) << i;
    if (result.health == LocalizationHealth::kWeak) {
      EXPECT_GT(std::sqrt(result.covariance(0, 0)), 5.0) << i;
    }
  }
}

TEST(LostVehicleTest, AScanForWhichTheMapCouldNotBeAskedCountsForNothing) {
  const LocalizerOptions options = QuickOptions();
  auto relocalizer = std::make_shared<const Relocalizer>(RelocalizerIn(StreetMap(), options));
  Status failure;
  int asked = 0;
  Localizer localizer(StreetMap().profile(), StreetMap().Source(), options,
                      [&]() -> Result<std::shared_ptr<const Relocalizer>> {
                        ++asked;
                        if (failure.ok()) return relocalizer;
                        return Error(failure);
                      });
  Localizer untroubled = LocalizerIn(StreetMap(), options);
  localizer.Start(OnStreet(-60.0));
  untroubled.Start(OnStreet(-60.0));
  for (int i = 0; i < 10; ++i) {
    const Pose truth = OnStreet(2.0 + 0.5 * i);
    failure = Status(StatusCode::kUnavailable, "no daemon");
    const int before = asked;
    auto result =
        localizer.Localize(CastLeveledScan(testing::QuickSensor(), testing::Street(), truth),
                           Eigen::Quaterniond::Identity());
    EXPECT_EQ(result.has_value(), asked == before) << i;
    failure = Status();
    if (!result) {
      EXPECT_EQ(result.error().code(), StatusCode::kUnavailable);
      result = At(localizer, testing::Street(), truth);
    }
    const LocalizationResult expected = At(untroubled, testing::Street(), truth);
    EXPECT_EQ(result->health, expected.health) << i;
    EXPECT_TRUE(result->T_world_sensor.isApprox(expected.T_world_sensor, 1e-12)) << i;
  }
  EXPECT_GT(asked, 0);
  EXPECT_TRUE(IsGood(At(localizer, testing::Street(), OnStreet(7.0)), OnStreet(7.0)));
}

}  // namespace
}  // namespace atlas
