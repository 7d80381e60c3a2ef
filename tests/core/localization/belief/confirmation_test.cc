// Vehicles that are carried from one deck to another, in garages of two.
#include "core/localization/belief/confirmation.h"

#include <cmath>
#include <optional>
#include <vector>

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

// A place on the lower deck that is known. So large a share of each scan's columns is as the upper
// deck shows it from the same spot.
class KnownPlace {
 public:
  explicit KnownPlace(const ConfirmationOptions& options = {})
      : confirmation_(options, RegistrationOptions()) {
    confirmation_.Trust();
  }

  void Weigh(double share_above) {
    ScanFeatures features = here_;
    features.columns.clear();
    Mix(here_.columns, 1.0 - share_above, features.columns);
    Mix(above_.columns, share_above, features.columns);
    const RegistrationResult here = Register(window_, features, pose_, RegistrationOptions());
    EXPECT_FALSE(confirmation_.Weigh(window_, features, here, 0.7, true));
  }
  const Confirmation& known() const { return confirmation_; }

 private:
  static void Mix(const std::vector<Eigen::Vector3f>& columns,
                  double share,
                  std::vector<Eigen::Vector3f>& mixed) {
    double due = 0.0;
    for (const Eigen::Vector3f& column : columns) {
      due += share;
      if (due < 1.0) continue;
      due -= 1.0;
      mixed.push_back(column);
    }
  }

  Pose pose_ = OnDeck(0.0, -2.0, -3.0, 0.4);
  MapWindow window_ = GarageMap().Window({0.0, 0.0, 1.8}, 25.0);
  ScanFeatures here_ = FeaturesAt(testing::GarageCorner(), pose_);
  ScanFeatures above_ = FeaturesAt(testing::GarageCorner(), OnDeck(kFloor_m, -2.0, -3.0, 0.4));
  Confirmation confirmation_;
};

TEST(ConfirmationTest, SingleScansThatFitBetterOnAnotherDeckPutNoKnownPlaceInDoubt) {
  const auto is_suspected = [](double share_above) {
    KnownPlace fresh;
    fresh.Weigh(share_above);
    return fresh.known().is_suspected();
  };
  double above = 0.0;  // hardly so much that it counts
  while (above < 1.0 && !is_suspected(above)) above += 0.02;
  ASSERT_LT(above, 1.0);
  KnownPlace place;
  const int enough = ConfirmationOptions().suspected_scans;
  for (int round = 0; round < 3; ++round) {
    for (int i = 1; i < enough; ++i) {
      place.Weigh(above);
      EXPECT_TRUE(place.known().is_suspected()) << i;
    }
    place.Weigh(0.0);
    EXPECT_TRUE(place.known().is_confirmed());
    EXPECT_FALSE(place.known().is_suspected());
  }
  for (int i = 0; i < enough; ++i) place.Weigh(above);
  EXPECT_FALSE(place.known().is_confirmed());
}

TEST(ConfirmationTest, AScanOfFewColumnsSaysLessOfADeck) {
  ConfirmationOptions options;
  options.many_columns = 1.0;
  KnownPlace many(options);
  many.Weigh(1.0);
  EXPECT_TRUE(many.known().is_suspected());
  options.many_columns = 1e6;
  KnownPlace few(options);
  few.Weigh(1.0);
  EXPECT_FALSE(few.known().is_suspected());
}

// Half of the lower deck was not mapped, and the upper one is as the lower one: it explains more.
TEST(ConfirmationTest, ADeckThatWasMappedBetterIsNotTheLikelierOne) {
  const std::vector<std::optional<float>> here{0.9F, 0.8F, std::nullopt, std::nullopt};
  const std::vector<std::optional<float>> there{0.8F, 0.8F, 0.9F, 0.9F};
  EXPECT_NEAR(CommonLead(here, there, 1.0), 2.5 * 0.05, 1e-6);
  EXPECT_NEAR(CommonLead(there, here, 1.0), -2.5 * 0.05, 1e-6);
  EXPECT_NEAR(CommonLead(here, there, 8.0), 0.5 * 2.5 * 0.05, 1e-6);
  const std::vector<std::optional<float>> unknown(4);
  EXPECT_EQ(CommonLead(here, unknown, 1.0), 0.0);
}

}  // namespace
}  // namespace atlas
