// Vehicles that are carried from one deck to another, in garages of two.
#include "core/localization/confirmation.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::GarageMap;
using testing::QuickOptions;
using testing::ShapeWorld;
using testing::StreetMap;
using testing::UprightPose;

constexpr double kFloor_m = 3.0;  // of the upper deck

LocalizationResult At(Localizer& localizer, const ShapeWorld& world, const Pose& truth) {
  return localizer
      .Localize(CastLeveledScan(testing::QuickSensor(), world, truth),
                Eigen::Quaterniond::Identity())
      .value();
}

Pose OnDeck(double floor_m, double x_m, double y_m, double yaw_rad) {
  return UprightPose({x_m, y_m, floor_m + 1.8}, yaw_rad);
}

ScanFeatures FeaturesAt(const ShapeWorld& world, const Pose& pose) {
  return ExtractFeatures(CastLeveledScan(testing::QuickSensor(), world, pose),
                         QuickOptions().features);
}

TEST(OtherDecksTest, AreThoseAboveAndBelowAndAStreetHasNone) {
  DeckFinder finder{DeckOptions()};
  const MapWindow garage = GarageMap().Window({0.0, 0.0, 1.8}, 25.0);
  for (const double floor_m : {0.0, kFloor_m}) {
    const Pose pose = OnDeck(floor_m, -2.0, -3.0, 0.4);
    const auto decks = finder.Find(garage, FeaturesAt(testing::GarageCorner(), pose), pose);
    ASSERT_EQ(decks.size(), 1U) << floor_m;
    EXPECT_NEAR(decks.front(), kFloor_m - 2.0 * floor_m, 0.25);
  }
  const Pose pose = UprightPose({0.0, 0.0, 1.8}, 0.0);
  const MapWindow street = StreetMap().Window(pose.translation(), 25.0);
  EXPECT_TRUE(finder.Find(street, FeaturesAt(testing::Street(), pose), pose).empty());
}

TEST(ConfirmationTest, AVehicleCarriedToAnotherDeckIsFoundOnItAndNotCalledGoodBefore) {
  for (const double floor_m : {0.0, kFloor_m}) {
    Localizer localizer(GarageMap().profile(), GarageMap().Source(), QuickOptions());
    localizer.Start(OnDeck(floor_m, -6.0, -4.0, 0.3));
    for (int i = 0; i < 4; ++i) {
      const Pose pose = OnDeck(floor_m, -6.0 + 0.5 * i, -4.0, 0.3);
      EXPECT_EQ(At(localizer, testing::GarageCorner(), pose).health, LocalizationHealth::kGood);
    }
    int good = 0;
    for (int i = 0; i < 16; ++i) {
      const Pose pose = OnDeck(kFloor_m - floor_m, -2.0 + 0.3 * i, -1.0, 1.1);
      const LocalizationResult result = At(localizer, testing::GarageCorner(), pose);
      const double error_m = (result.T_world_sensor.translation() - pose.translation()).norm();
      if (result.health == LocalizationHealth::kGood) {
        EXPECT_LT(error_m, 0.1) << floor_m << " " << i;
        ++good;
      } else if (result.health == LocalizationHealth::kWeak && error_m > 1.0) {
        EXPECT_GT(std::sqrt(result.covariance(2, 2)), 3.0) << i;
      }
    }
    EXPECT_GE(good, 6) << floor_m;
  }
}

// A place that is known, as scans say it that fit so well there.
class KnownPlace {
 public:
  explicit KnownPlace(const ConfirmationOptions& options = {})
      : confirmation_(options, RegistrationOptions()) {
    confirmation_.Trust();
  }

  void Weigh(double fit) {
    RegistrationResult here;
    here.T_world_level = pose_;
    here.fit = fit;
    here.evidence = fit * static_cast<double>(features_.columns.size());
    here.column_inliers = 1.0;
    EXPECT_FALSE(confirmation_.Weigh(window_, features_, here, 0.7, true));
  }
  const Confirmation& known() const { return confirmation_; }

 private:
  Pose pose_ = OnDeck(0.0, -2.0, -3.0, 0.4);
  MapWindow window_ = GarageMap().Window({0.0, 0.0, 1.8}, 25.0);
  ScanFeatures features_ = FeaturesAt(testing::GarageCorner(), pose_);
  Confirmation confirmation_;
};

TEST(ConfirmationTest, SingleScansThatFitBetterOnAnotherDeckPutNoKnownPlaceInDoubt) {
  const auto is_suspected = [](double fit) {
    KnownPlace fresh;
    fresh.Weigh(fit);
    return fresh.known().is_suspected();
  };
  double worse = 1.0;  // hardly so much that it counts
  while (worse > 0.0 && !is_suspected(worse)) worse -= 0.02;
  ASSERT_GT(worse, 0.0);
  KnownPlace place;
  const int enough = ConfirmationOptions().suspected_scans;
  for (int round = 0; round < 3; ++round) {
    for (int i = 1; i < enough; ++i) {
      place.Weigh(worse);
      EXPECT_TRUE(place.known().is_suspected()) << i;
    }
    place.Weigh(1.0);
    EXPECT_TRUE(place.known().is_confirmed());
    EXPECT_FALSE(place.known().is_suspected());
  }
  for (int i = 0; i < enough; ++i) place.Weigh(worse);
  EXPECT_FALSE(place.known().is_confirmed());
}

TEST(ConfirmationTest, AScanOfFewColumnsSaysLessOfADeck) {
  ConfirmationOptions options;
  options.many_columns = 1.0;
  KnownPlace many(options);
  many.Weigh(0.1);
  EXPECT_TRUE(many.known().is_suspected());
  options.many_columns = 1e6;
  KnownPlace few(options);
  few.Weigh(0.1);
  EXPECT_FALSE(few.known().is_suspected());
}

}  // namespace
}  // namespace atlas
