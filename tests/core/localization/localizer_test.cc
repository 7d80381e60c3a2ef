// Drives through small worlds, scan after scan.
#include "core/localization/localizer.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::GarageMap;
using testing::kDegree;
using testing::PaintedMap;
using testing::PoseError;
using testing::QuickOptions;
using testing::ShapeWorld;
using testing::StreetMap;
using testing::UprightPose;

const Eigen::Quaterniond kLevel = Eigen::Quaterniond::Identity();

LocalizationResult At(Localizer& localizer, const ShapeWorld& world, const Pose& truth) {
  return localizer.Localize(CastLeveledScan(testing::QuickSensor(), world, truth), kLevel).value();
}

// Along the street on the map's slope.
Pose OnStreet(double x_m, double y_m = 0.0, double yaw_rad = 0.0) {
  return UprightPose({x_m, y_m, 1.8 + 0.01 * x_m}, yaw_rad);
}

Localizer StreetLocalizer() {
  return {StreetMap().profile(), StreetMap().Source(), QuickOptions()};
}

TEST(LocalizerTest, FollowsADriveFromARoughStart) {
  Localizer localizer = StreetLocalizer();
  localizer.Start(OnStreet(-14.7, 0.3, 1.0 * kDegree));
  for (int i = 0; i < 20; ++i) {
    const Pose truth = OnStreet(-15.0 + 1.5 * i, 0.4 * std::sin(0.3 * i), 0.05 * std::cos(0.3 * i));
    const LocalizationResult result = At(localizer, testing::Street(), truth);
    EXPECT_EQ(result.health, LocalizationHealth::kGood) << i;
    const PoseError error = ErrorOf(result.T_world_sensor, truth);
    EXPECT_LT(error.horizontal_m, 0.06) << i;
    EXPECT_LT(error.vertical_m, 0.03) << i;
    EXPECT_LT(error.angle_rad, 0.3 * kDegree) << i;
  }
}

TEST(LocalizerTest, FindsTheSecondScanHoweverFastTheVehicleIs) {
  for (const double ahead_m : {0.0, 1.0, 2.5, 4.0}) {
    Localizer localizer = StreetLocalizer();
    localizer.Start(OnStreet(-6.0));
    At(localizer, testing::Street(), OnStreet(-6.0));
    const Pose truth = OnStreet(-6.0 + ahead_m);
    const LocalizationResult result = At(localizer, testing::Street(), truth);
    EXPECT_EQ(result.health, LocalizationHealth::kGood) << ahead_m;
    EXPECT_LT(ErrorOf(result.T_world_sensor, truth).horizontal_m, 0.06) << ahead_m;
  }
}

// At 2 m a scan, of which two to four in a row are missing.
TEST(LocalizerTest, GoesOnBehindScansThatAreMissing) {
  Localizer localizer = StreetLocalizer();
  double x_m = -14.0;
  localizer.Start(OnStreet(x_m));
  for (const int scans : {0, 1, 1, 1, 3, 1, 5, 1}) {
    x_m += 2.0 * scans;
    const Pose truth = OnStreet(x_m);
    const auto scan = CastLeveledScan(testing::QuickSensor(), testing::Street(), truth);
    const LocalizationResult result = localizer.Localize(scan, kLevel, std::max(scans, 1)).value();
    EXPECT_EQ(result.health, LocalizationHealth::kGood) << x_m;
    EXPECT_LT(ErrorOf(result.T_world_sensor, truth).horizontal_m, 0.06) << x_m;
  }
}

// A recorder that waits with it: the vehicle stands for so long, and goes on or not.
TEST(LocalizerTest, StandsInAPause) {
  for (const double pause : {6.0, 13.0, 40.0, 100.0}) {
    for (const double ahead_m : {0.0, 2.0}) {
      Localizer localizer = StreetLocalizer();
      localizer.Start(OnStreet(-14.0));
      for (int i = 0; i < 4; ++i) At(localizer, testing::Street(), OnStreet(-14.0 + 2.0 * i));
      for (int i = 0; i < 5; ++i) {
        const Pose truth = OnStreet(-8.0 + ahead_m + 2.0 * i);
        const auto scan = CastLeveledScan(testing::QuickSensor(), testing::Street(), truth);
        const LocalizationResult result =
            localizer.Localize(scan, kLevel, i == 0 ? pause : 1.0).value();
        EXPECT_NE(result.health, LocalizationHealth::kLost)
            << pause << ", " << ahead_m << ", " << i;
        EXPECT_LT(ErrorOf(result.T_world_sensor, truth).horizontal_m, 0.06) << pause << ", " << i;
        const bool is_confirmed = result.health == LocalizationHealth::kGood;
        EXPECT_TRUE(is_confirmed || i < 3) << pause << ", " << ahead_m << ", " << i;
      }
    }
  }
}

TEST(LocalizerTest, WhoDroveOnInAPauseIsNotTakenForStanding) {
  Localizer localizer = StreetLocalizer();
  localizer.Start(OnStreet(-18.0));
  for (int i = 0; i < 4; ++i) At(localizer, testing::Street(), OnStreet(-18.0 + 2.0 * i));
  const Pose truth = OnStreet(-12.0 + 7 * 2.0);
  const auto scan = CastLeveledScan(testing::QuickSensor(), testing::Street(), truth);
  const LocalizationResult result = localizer.Localize(scan, kLevel, 7.0).value();
  EXPECT_EQ(result.health, LocalizationHealth::kGood);
  EXPECT_LT(ErrorOf(result.T_world_sensor, truth).horizontal_m, 0.06);
}

// Where it was told to be is not where it seems to be: it may be a place that looks like it.
TEST(LocalizerTest, AFirstPlaceFarFromTheToldOneIsConfirmedFirst) {
  Localizer localizer = StreetLocalizer();
  localizer.Start(OnStreet(-6.0 - 2.5), StartHint{1.0, 0.1});
  for (int i = 0; i < 6; ++i) {
    const Pose truth = OnStreet(-6.0 + i);
    const LocalizationResult result = At(localizer, testing::Street(), truth);
    EXPECT_EQ(result.health, i < 2 ? LocalizationHealth::kWeak : LocalizationHealth::kGood) << i;
    EXPECT_LT(ErrorOf(result.T_world_sensor, truth).horizontal_m, 0.06) << i;
  }
}

TEST(LocalizerTest, AVagueStartIsFoundAtOnceWhereNothingLooksLikeIt) {
  for (const double off_m : {-2.8, -1.5, 2.0}) {
    Localizer localizer = StreetLocalizer();
    localizer.Start(OnStreet(-6.0 + off_m, 1.0, 15.0 * kDegree));
    const LocalizationResult result = At(localizer, testing::Street(), OnStreet(-6.0));
    EXPECT_EQ(result.health, LocalizationHealth::kGood) << off_m;
    EXPECT_LT(ErrorOf(result.T_world_sensor, OnStreet(-6.0)).horizontal_m, 0.06) << off_m;
  }
}

// Walls hold it everywhere but in height: there is no ground where it should be.
TEST(LocalizerTest, WhereTheHeightIsUnknownItIsWeak) {
  Localizer localizer = StreetLocalizer();
  Pose above = OnStreet(-6.0);
  above.translation().z() += 3.2;
  localizer.Start(above);
  for (int i = 0; i < 4; ++i) {
    const Pose truth = OnStreet(-6.0 + i);
    const LocalizationResult result = At(localizer, testing::Street(), truth);
    const bool is_right = ErrorOf(result.T_world_sensor, truth).vertical_m < 0.1;
    EXPECT_TRUE(is_right || result.health != LocalizationHealth::kGood) << i;
  }
}

TEST(LocalizerTest, FindsItsHeadingAfterASharpTurn) {
  for (const double turn_deg : {-30.0, -18.0, 20.0, 32.0}) {
    Localizer localizer = StreetLocalizer();
    localizer.Start(OnStreet(-4.0));
    for (int i = 0; i < 4; ++i) {
      At(localizer, testing::Street(), OnStreet(-4.0 + i));
    }
    const Pose truth = OnStreet(-0.1, 0.1, turn_deg * kDegree);
    const LocalizationResult result = At(localizer, testing::Street(), truth);
    EXPECT_EQ(result.health, LocalizationHealth::kGood) << turn_deg;
    EXPECT_LT(ErrorOf(result.T_world_sensor, truth).angle_rad, 0.3 * kDegree) << turn_deg;
  }
}

TEST(LocalizerTest, StaysOnItsDeckOfTwo) {
  for (const double floor_m : {0.0, 3.0}) {
    Localizer localizer(GarageMap().profile(), GarageMap().Source(), QuickOptions());
    const auto at = [floor_m](int i) {
      return UprightPose({-9.0 + 0.8 * i, -5.0 + 0.3 * i, floor_m + 1.8}, 0.36);
    };
    Pose start = at(0);
    start.translation() += Eigen::Vector3d(0.2, -0.2, 0.25);
    localizer.Start(start);
    for (int i = 0; i < 14; ++i) {
      const LocalizationResult result = At(localizer, testing::GarageCorner(), at(i));
      EXPECT_EQ(result.health, LocalizationHealth::kGood) << floor_m << " " << i;
      EXPECT_LT(ErrorOf(result.T_world_sensor, at(i)).vertical_m, 0.03) << floor_m << " " << i;
      EXPECT_LT(ErrorOf(result.T_world_sensor, at(i)).horizontal_m, 0.08) << floor_m << " " << i;
    }
  }
}

TEST(LocalizerTest, ACorridorIsWeakAndCarriesTheVehicleOnAtItsSpeed) {
  PaintedMap map;
  map.Paint(testing::Corridor(), 30.0);
  Localizer localizer(map.profile(), map.Source(), QuickOptions());
  const auto at = [](int i) {
    return UprightPose({-3.0 + 0.1 * i, 0.0, 1.8}, 0.0);
  };
  localizer.Start(at(0));
  for (int i = 0; i < 5; ++i) {
    const LocalizationResult result = At(localizer, testing::Corridor(), at(i));
    EXPECT_EQ(result.health, LocalizationHealth::kWeak) << i;
    EXPECT_LT(std::abs(result.T_world_sensor.translation().y()), 0.03) << i;
  }
}

// Posts 2.5 m apart on either side of a road without end.
class AmongPostsTest : public ::testing::Test {
 protected:
  AmongPostsTest() {
    world_.patches = {testing::Patch{}};
    for (int i = -16; i <= 16; ++i) {
      for (const double y_m : {-4.05, 4.05}) {
        world_.boxes.push_back(
            testing::Box{{2.5 * i + 0.05, y_m, -1.0}, {2.5 * i + 0.25, y_m + 0.2, 4.0}});
      }
    }
    map_.Paint(world_, 42.0);
  }

  Localizer NewLocalizer() const {
    LocalizerOptions options = QuickOptions();
    options.features.max_range_m = 15.0F;
    return {map_.profile(), map_.Source(), options};
  }
  static Pose Beside(double posts) { return UprightPose({-5.0 + 2.5 * posts, 0.3, 1.8}, 0.0); }

  ShapeWorld world_;
  PaintedMap map_;
};

// Wherever in three metres it starts, it is beside some post, and does not say which.
TEST_F(AmongPostsTest, AVagueStartMayBeBesideAnyOfThem) {
  for (const double off : {-0.9, -0.4, 0.0, 0.3, 1.0}) {
    Localizer localizer = NewLocalizer();
    localizer.Start(Beside(off));
    const LocalizationResult result = At(localizer, world_, Beside(0));
    EXPECT_EQ(result.health, LocalizationHealth::kWeak) << off;
    EXPECT_GT(std::sqrt(result.covariance(0, 0)), 0.3) << off;
  }
}

TEST_F(AmongPostsTest, ABelievedStartIsBesideTheOneWithinReach) {
  for (const double off : {-0.15, 0.0, 0.15}) {
    Localizer localizer = NewLocalizer();
    const Eigen::Vector4d sigmas(0.2, 0.2, 0.2, 0.02);
    localizer.Start(Beside(off), PoseCovariance(sigmas.cwiseAbs2().asDiagonal()));
    const LocalizationResult result = At(localizer, world_, Beside(0));
    EXPECT_EQ(result.health, LocalizationHealth::kGood) << off;
    EXPECT_LT(ErrorOf(result.T_world_sensor, Beside(0)).horizontal_m, 0.06) << off;
  }
}

// A vehicle whose speed nobody knows may have moved on by one of them.
TEST_F(AmongPostsTest, ItDoesNotSayWhichAreBesideIt) {
  Localizer localizer = NewLocalizer();
  localizer.Start(Beside(0), StartHint{0.5, 0.1});
  EXPECT_EQ(At(localizer, world_, Beside(0)).health, LocalizationHealth::kGood) << "it was told";
  const LocalizationResult result = At(localizer, world_, Beside(1));
  EXPECT_EQ(result.health, LocalizationHealth::kWeak);
  EXPECT_GT(std::sqrt(result.covariance(0, 0)), 1.0) << "ahead: one post or another";
  EXPECT_LT(std::sqrt(result.covariance(1, 1)), 0.3);
  EXPECT_NEAR(result.T_world_sensor.translation().y(), 0.3, 0.05);
}

// A bare plain to the west, houses to the east: nothing tells the speed until they are in sight.
TEST(LocalizerTest, AdriftOnAPlainItIsFoundWhereStructureBegins) {
  ShapeWorld world;
  world.patches = {testing::Patch{}};
  world.boxes = {testing::Box{{6.05, 4.05, -1.0}, {12.05, 9.05, 6.0}},
                 testing::Box{{15.05, -11.05, -1.0}, {19.05, -5.05, 6.0}},
                 testing::Box{{8.05, -7.05, -1.0}, {8.45, -6.65, 6.0}}};
  PaintedMap map;
  map.Paint(world, 45.0);
  Localizer localizer(map.profile(), map.Source(), QuickOptions());
  const auto at = [](int i) {
    return UprightPose({-42.0 + 1.6 * i, 0.0, 1.8}, 0.0);
  };
  localizer.Start(at(0));
  int found = 0;
  for (int i = 0; i <= 30; ++i) {
    const LocalizationResult result = At(localizer, world, at(i));
    const double error_m = ErrorOf(result.T_world_sensor, at(i)).horizontal_m;
    if (result.health == LocalizationHealth::kGood) {
      EXPECT_LT(error_m, 0.15) << i;
      ++found;
    }
    if (i >= 20) {  // 10 m before the first house
      EXPECT_LT(error_m, 0.15) << i;
    }
  }
  EXPECT_GE(found, 8);
}

TEST(LocalizerTest, TiltComesFromTheImu) {
  const Eigen::Quaterniond R_level_sensor(
      Eigen::AngleAxisd(6.0 * kDegree, Eigen::Vector3d(0.8, 0.6, 0.0)));
  Localizer localizer = StreetLocalizer();
  localizer.Start(OnStreet(0.1));
  const Pose truth = OnStreet(0.0);
  const LocalizationResult result =
      localizer
          .Localize(CastLeveledScan(testing::QuickSensor(), testing::Street(), truth),
                    R_level_sensor)
          .value();
  Pose tilted = truth;
  tilted.linear() = truth.linear() * R_level_sensor.toRotationMatrix();
  EXPECT_EQ(result.health, LocalizationHealth::kGood);
  EXPECT_LT(ErrorOf(result.T_world_sensor, tilted).angle_rad, 0.3 * kDegree);
  EXPECT_LT(ErrorOf(result.T_world_sensor, tilted).horizontal_m, 0.06);
}

TEST(LocalizerTest, TheSameDriveHasTheSameAnswers) {
  const auto drive = [] {
    std::vector<Eigen::Matrix4d> poses;
    Localizer localizer = StreetLocalizer();
    localizer.Start(OnStreet(-8.2, 0.2));
    for (int i = 0; i < 8; ++i) {
      poses.push_back(
          At(localizer, testing::Street(), OnStreet(-8.0 + 1.3 * i)).T_world_sensor.matrix());
    }
    return poses;
  };
  EXPECT_EQ(drive(), drive());
}

TEST(LocalizerTest, StartForgetsTheMotionAndThePlace) {
  Localizer localizer = StreetLocalizer();
  localizer.Start(OnStreet(-10.0));
  for (int i = 0; i < 4; ++i) {
    At(localizer, testing::Street(), OnStreet(-10.0 + 1.4 * i));
  }
  const Pose elsewhere = OnStreet(13.0, -1.0, 3.0);
  localizer.Start(elsewhere);
  const LocalizationResult result = At(localizer, testing::Street(), elsewhere);
  EXPECT_EQ(result.health, LocalizationHealth::kGood);
  EXPECT_LT(ErrorOf(result.T_world_sensor, elsewhere).horizontal_m, 0.06);
}

TEST(LocalizationHealthTest, EveryHealthHasAName) {
  EXPECT_EQ(LocalizationHealthName(LocalizationHealth::kGood), "good");
  EXPECT_EQ(LocalizationHealthName(LocalizationHealth::kWeak), "weak");
  EXPECT_EQ(LocalizationHealthName(LocalizationHealth::kLost), "lost");
}

}  // namespace
}  // namespace atlas
