// Maps with holes, wrong maps, no maps, and sources of tiles that fail.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/localization/localizer.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::kDegree;
using testing::PaintedMap;
using testing::QuickOptions;
using testing::ShapeWorld;
using testing::StreetMap;
using testing::UprightPose;

using Tiles = std::vector<std::shared_ptr<const Tile>>;

// Gives what the test sets, and counts.
struct Source {
  Tiles tiles;
  Status failure;
  int asked = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius_m = 0.0;

  TilesAround Function() {
    return [this](const Eigen::Vector3d& around, double radius) -> Result<Tiles> {
      ++asked;
      center = around;
      radius_m = radius;
      return failure.ok() ? Result<Tiles>(tiles) : Error(failure);
    };
  }
};

// A thicket that looks like no street.
ShapeWorld Thicket() {
  ShapeWorld world;
  world.patches = {testing::Patch{-1.5}};
  for (int i = 0; i < 80; ++i) {
    const double x = std::floor(300.0 * std::cos(2.4 * i) * std::sqrt(i / 80.0)) * 0.1 + 0.05;
    const double y = std::floor(300.0 * std::sin(2.4 * i) * std::sqrt(i / 80.0)) * 0.1 + 0.05;
    world.boxes.push_back(testing::Box{{x, y, -2.0}, {x + 0.7, y + 0.4, 3.0}});
  }
  return world;
}

class LocalizerFaultTest : public ::testing::Test {
 protected:
  LocalizerFaultTest() { source_.tiles = StreetMap().Tiles(); }

  static Pose OnStreet(double x_m) { return UprightPose({x_m, 0.0, 1.8 + 0.01 * x_m}, 0.0); }

  LocalizationResult At(const Pose& truth) {
    return localizer_
        .Localize(CastLeveledScan(testing::QuickSensor(), testing::Street(), truth),
                  Eigen::Quaterniond::Identity())
        .value();
  }
  LocalizationResult Blind() {
    return localizer_.Localize(LeveledScan(), Eigen::Quaterniond::Identity()).value();
  }

  static Tiles WrongTiles() {
    PaintedMap map;
    map.Paint(Thicket(), 30.0);
    return map.Tiles();
  }

  Source source_;
  Localizer localizer_{StreetMap().profile(), source_.Function(), QuickOptions()};
};

TEST_F(LocalizerFaultTest, WithoutAMapItIsLostWhereItStarted) {
  source_.tiles.clear();
  localizer_.Start(OnStreet(0.0));
  for (int i = 0; i < 3; ++i) {
    const LocalizationResult result = At(OnStreet(1.0 * i));
    EXPECT_EQ(result.health, LocalizationHealth::kLost);
    EXPECT_LT(ErrorOf(result.T_world_sensor, OnStreet(0.0)).horizontal_m, 1e-9) << i;
  }
}

TEST_F(LocalizerFaultTest, BlindItIsLostGoesOnAsItDidAndIsFoundThere) {
  localizer_.Start(OnStreet(-10.0));
  for (int i = 0; i < 4; ++i) {
    At(OnStreet(-10.0 + 1.2 * i));
  }
  for (int i = 0; i < 3; ++i) {
    const Pose expected = OnStreet(-10.0 + 1.2 * (4 + i));
    const LocalizationResult result = Blind();
    EXPECT_EQ(result.health, LocalizationHealth::kLost);
    EXPECT_LT(ErrorOf(result.T_world_sensor, expected).horizontal_m, 0.15) << i;
    EXPECT_LT(ErrorOf(result.T_world_sensor, expected).angle_rad, 1.0 * kDegree) << i;
  }
  const Pose moved = OnStreet(-10.0 + 1.2 * 7);
  const LocalizationResult found = At(moved);
  EXPECT_EQ(found.health, LocalizationHealth::kGood);
  EXPECT_LT(ErrorOf(found.T_world_sensor, moved).horizontal_m, 0.06);
}

// Scans that fail for want of tiles are time that has passed.
TEST_F(LocalizerFaultTest, WhileTheTilesFailItGoesOnAsItDid) {
  LocalizerOptions options = QuickOptions();
  options.tracker.map.margin_m = 0.0;  // asks for tiles with every scan
  localizer_ = Localizer(StreetMap().profile(), source_.Function(), options);
  localizer_.Start(OnStreet(-10.0));
  for (int i = 0; i < 4; ++i) {
    At(OnStreet(-10.0 + 1.2 * i));
  }
  source_.failure = Status(StatusCode::kUnavailable, "a cable");
  for (int i = 0; i < 3; ++i) {
    const auto failed = localizer_.Localize(LeveledScan(), Eigen::Quaterniond::Identity());
    ASSERT_FALSE(failed.has_value());
    EXPECT_EQ(failed.error().code(), StatusCode::kUnavailable);
  }
  source_.failure = Status();
  const Pose expected = OnStreet(-10.0 + 1.2 * 7);
  EXPECT_LT(ErrorOf(Blind().T_world_sensor, expected).horizontal_m, 0.15);
  const Pose next = OnStreet(-10.0 + 1.2 * 8);
  const LocalizationResult found = At(next);
  EXPECT_EQ(found.health, LocalizationHealth::kGood);
  EXPECT_LT(ErrorOf(found.T_world_sensor, next).horizontal_m, 0.06);
}

TEST_F(LocalizerFaultTest, AWrongMapIsNotBelieved) {
  source_.tiles = WrongTiles();
  localizer_.Start(OnStreet(0.0));
  EXPECT_EQ(At(OnStreet(0.0)).health, LocalizationHealth::kLost);
}

TEST_F(LocalizerFaultTest, OnAWrongMapItDoesNotSpin) {
  LocalizerOptions options = QuickOptions();
  options.tracker.map.margin_m = 0.0;  // asks for tiles with every scan
  localizer_ = Localizer(StreetMap().profile(), source_.Function(), options);
  localizer_.Start(OnStreet(-10.0));
  for (int i = 0; i < 4; ++i) {
    At(OnStreet(-10.0 + 0.5 * i));
  }
  source_.tiles = WrongTiles();
  for (int i = 0; i < 5; ++i) {
    const Pose expected = OnStreet(-8.0 + 0.5 * i);
    const LocalizationResult result = At(expected);
    EXPECT_EQ(result.health, LocalizationHealth::kLost) << i;
    EXPECT_LT(ErrorOf(result.T_world_sensor, expected).angle_rad, 1.0 * kDegree) << i;
    EXPECT_LT(ErrorOf(result.T_world_sensor, expected).horizontal_m, 0.15) << i;
  }
  source_.tiles = StreetMap().Tiles();
  EXPECT_EQ(At(OnStreet(-5.5)).health, LocalizationHealth::kGood);
}

TEST_F(LocalizerFaultTest, AVehicleThatBrakedWhileBlindIsFound) {
  // It braked while it was blind, and was taken to go on for four scans.
  localizer_.Start(OnStreet(-10.0));
  for (int i = 0; i < 4; ++i) {
    At(OnStreet(-10.0 + 0.5 * i));
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(Blind().health, LocalizationHealth::kLost);
  }
  LocalizationResult result;
  for (int i = 0; i < 3; ++i) {
    result = At(OnStreet(-8.5));
  }
  EXPECT_EQ(result.health, LocalizationHealth::kGood);
  EXPECT_LT(ErrorOf(result.T_world_sensor, OnStreet(-8.5)).horizontal_m, 0.06);
}

TEST_F(LocalizerFaultTest, AMissingTileLeavesTheOthers) {
  // One tile and another is not there: the rest holds the vehicle.
  for (const std::size_t missing : {20U, 38U, 44U, 45U, 54U}) {
    source_.tiles = StreetMap().Tiles();
    ASSERT_LT(missing, source_.tiles.size());
    source_.tiles.erase(source_.tiles.begin() + static_cast<std::ptrdiff_t>(missing));
    localizer_ = Localizer(StreetMap().profile(), source_.Function(), QuickOptions());
    localizer_.Start(OnStreet(0.2));
    const LocalizationResult result = At(OnStreet(0.0));
    EXPECT_EQ(result.health, LocalizationHealth::kGood) << missing;
    EXPECT_LT(ErrorOf(result.T_world_sensor, OnStreet(0.0)).horizontal_m, 0.06) << missing;
  }
}

TEST_F(LocalizerFaultTest, AtTheEdgeOfTheMapHalfOfItIsEnough) {
  std::erase_if(source_.tiles, [](const auto& tile) { return tile->id.x >= 0; });
  localizer_.Start(OnStreet(-3.1));
  for (int i = 0; i < 4; ++i) {  // into the unmapped half
    const Pose truth = OnStreet(-3.0 + 1.0 * i);
    const LocalizationResult result = At(truth);
    EXPECT_NE(result.health, LocalizationHealth::kLost) << i;
    EXPECT_LT(ErrorOf(result.T_world_sensor, truth).horizontal_m, 0.1) << i;
  }
}

TEST_F(LocalizerFaultTest, ACoarseMapIsEnoughToBeAboutThereAndIsSaidToBeCoarse) {
  for (const std::uint8_t level : {std::uint8_t{1}, std::uint8_t{2}}) {
    source_.tiles = StreetMap().TilesOfLevel(level);
    localizer_.Start(OnStreet(-8.1));
    double worst_m = 0.0;
    double sigma_m = 0.0;
    for (int i = 0; i < 8; ++i) {
      const Pose truth = OnStreet(-8.0 + 1.0 * i);
      const LocalizationResult result = At(truth);
      EXPECT_EQ(result.cover, MapCover::kCoarse) << i;
      EXPECT_NE(result.health, LocalizationHealth::kGood) << i;
      worst_m = std::max(worst_m, ErrorOf(result.T_world_sensor, truth).horizontal_m);
      sigma_m = std::sqrt(result.covariance(0, 0));
    }
    EXPECT_LT(worst_m, 0.2 * (1 << level));
    EXPECT_GT(3.0 * sigma_m, worst_m) << "its covariance says as much";
  }
}

TEST_F(LocalizerFaultTest, TilesThatComeLateAreTakenUpAtAStandstill) {
  const Tiles all = source_.tiles;
  source_.tiles.clear();
  localizer_.Start(OnStreet(0.1));
  EXPECT_EQ(At(OnStreet(0.0)).cover, MapCover::kNone);
  source_.tiles = StreetMap().TilesOfLevel(2);
  LocalizationResult result;
  int scans = 0;
  do {
    result = At(OnStreet(0.0));
  } while (result.cover != MapCover::kCoarse && ++scans < 20);
  EXPECT_LE(scans, 5);
  EXPECT_EQ(result.health, LocalizationHealth::kWeak);
  source_.tiles = all;
  scans = 0;
  do {
    result = At(OnStreet(0.0));
  } while (result.cover != MapCover::kFine && ++scans < 20);
  EXPECT_LE(scans, 5);
  EXPECT_EQ(result.health, LocalizationHealth::kGood);
  EXPECT_LT(ErrorOf(result.T_world_sensor, OnStreet(0.0)).horizontal_m, 0.06);
  const int asked = source_.asked;
  for (int i = 0; i < 12; ++i) {
    At(OnStreet(0.0));
  }
  EXPECT_EQ(source_.asked, asked) << "all is there";
}

TEST_F(LocalizerFaultTest, TheSourcesErrorIsTheAnswerAndHarmsNothing) {
  localizer_.Start(OnStreet(0.1));
  source_.failure = Status(StatusCode::kUnavailable, "no connection");
  const auto failed = localizer_.Localize(LeveledScan(), Eigen::Quaterniond::Identity());
  ASSERT_FALSE(failed.has_value());
  EXPECT_EQ(failed.error().code(), StatusCode::kUnavailable);
  source_.failure = Status();
  const LocalizationResult result = At(OnStreet(0.0));
  EXPECT_EQ(result.health, LocalizationHealth::kGood);
  EXPECT_LT(ErrorOf(result.T_world_sensor, OnStreet(0.0)).horizontal_m, 0.06);
}

TEST_F(LocalizerFaultTest, TilesAreAskedForWhenTheVehicleHasMovedOnly) {
  localizer_.Start(OnStreet(0.0));
  At(OnStreet(0.0));
  At(OnStreet(0.5));
  At(OnStreet(1.0));
  EXPECT_EQ(source_.asked, 1);
  EXPECT_LT((source_.center - OnStreet(0.0).translation()).norm(), 1e-9);
  EXPECT_DOUBLE_EQ(source_.radius_m, 35.0);
  for (const double x : testing::Steps(2.0, 9.0, 1.0)) {
    At(OnStreet(x));
  }
  EXPECT_EQ(source_.asked, 2);
}

}  // namespace
}  // namespace atlas
