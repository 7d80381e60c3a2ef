// Scans found in small worlds without a start.
#include "core/localization/relocalizer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
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
using testing::PlacesOf;
using testing::PoseError;
using testing::ShapeWorld;
using testing::StreetMap;
using testing::UprightPose;

const Eigen::Quaterniond kLevel = Eigen::Quaterniond::Identity();

Relocalizer RelocalizerIn(const PaintedMap& map) {
  RelocalizerOptions options;
  options.features.max_range_m = 25.0F;
  return {map.profile(), PlacesOf(map), map.Source(), options};
}

Relocalization Find(const Relocalizer& relocalizer,
                    const ShapeWorld& world,
                    const Pose& truth,
                    const std::optional<PlacePrior>& prior = std::nullopt) {
  return relocalizer.Find(CastLeveledScan(testing::QuickSensor(), world, truth), kLevel, prior)
      .value();
}

TEST(RelocalizerTest, FindsItselfAnywhereInAStreetInAnyHeadingAndIsNeverWrong) {
  const Relocalizer relocalizer = RelocalizerIn(StreetMap());
  int found = 0;
  int asked = 0;
  for (double x_m = -18.0; x_m <= 18.0; x_m += 4.5) {
    for (const double yaw_rad : {0.0, 1.1, 2.9, -1.8}) {
      const double y_m = 1.7 * std::sin(x_m);
      const Pose truth = UprightPose({x_m, y_m, 1.8 + 0.01 * x_m}, yaw_rad);
      const Relocalization result = Find(relocalizer, testing::Street(), truth);
      ++asked;
      if (!result.T_world_sensor) continue;
      ++found;
      const PoseError error = ErrorOf(*result.T_world_sensor, truth);
      EXPECT_LT(error.horizontal_m, 0.1) << truth.translation().transpose() << ", " << yaw_rad;
      EXPECT_LT(error.vertical_m, 0.05);
      EXPECT_LT(error.angle_rad, 0.5 * kDegree);
      EXPECT_GT(result.margin, 0.0);
    }
  }
  EXPECT_GT(found, asked * 3 / 4) << "of " << asked;
}

TEST(RelocalizerTest, ADeckIsNeverTakenForTheOther) {
  const Relocalizer relocalizer = RelocalizerIn(GarageMap());
  for (const double floor_m : {0.0, 3.0}) {
    int found = 0;
    for (const double x_m : {-6.0, 0.5, 5.0}) {
      for (const double y_m : {-4.0, 2.0}) {
        const Pose truth = UprightPose({x_m, y_m, floor_m + 1.8}, 0.4 * x_m + y_m);
        const Relocalization result = Find(relocalizer, testing::GarageCorner(), truth);
        if (!result.T_world_sensor) continue;
        ++found;
        EXPECT_LT(ErrorOf(*result.T_world_sensor, truth).vertical_m, 0.1);
        EXPECT_LT(ErrorOf(*result.T_world_sensor, truth).horizontal_m, 0.15);
      }
    }
    EXPECT_GT(found, 0) << floor_m;
  }
}

TEST(RelocalizerTest, NoPlaceCountsThatIsNotAtTheHeightThatIsKnown) {
  const Relocalizer relocalizer = RelocalizerIn(GarageMap());
  const Pose truth = UprightPose({0.5, 2.0, 1.8}, 0.7);
  PlacePrior prior;
  prior.height_m = 1.4;
  int found = 0;
  for (const double z_m : {0.6, 1.8, 3.0}) {
    prior.z_m = z_m;
    const Relocalization told = Find(relocalizer, testing::GarageCorner(), truth, prior);
    ASSERT_FALSE(told.places.empty());
    for (const RelocalizedPlace& place : told.places) {
      EXPECT_NEAR(place.registration.T_world_level.translation().z(), z_m, prior.height_m);
    }
    if (!told.T_world_sensor) continue;
    ++found;
    EXPECT_LT(ErrorOf(*told.T_world_sensor, truth).horizontal_m, 0.1);
  }
  EXPECT_EQ(found, 3);
  prior.z_m = 8.0;  // the deck above those that were mapped
  EXPECT_TRUE(Find(relocalizer, testing::GarageCorner(), truth, prior).places.empty());
}

TEST(RelocalizerTest, APriorThatSaysNothingIsRefused) {
  EXPECT_TRUE(PlacePrior().Validate().ok()) << "all unknown";
  for (const double wrong : {0.0, -1.0, 2e5, std::nan("")}) {
    PlacePrior prior;
    prior.radius_m = wrong;
    EXPECT_EQ(prior.Validate().code(), StatusCode::kInvalidArgument) << wrong;
    prior = {};
    prior.height_m = wrong;
    EXPECT_EQ(prior.Validate().code(), StatusCode::kInvalidArgument) << wrong;
  }
  PlacePrior prior;
  prior.z_m = std::nan("");
  EXPECT_EQ(prior.Validate().code(), StatusCode::kInvalidArgument);
}

TEST(RelocalizerTest, WhereTwoPlacesLookTheSameItDoesNotKnowUnlessItIsToldWhereAbout) {
  const ShapeWorld world = testing::TwoYards();
  PaintedMap map;
  map.Paint(world, 35.0);
  RelocalizerOptions options;
  options.features.max_range_m = 15.0F;
  const Relocalizer relocalizer(map.profile(), PlacesOf(map), map.Source(), options);
  // What lies beyond 15 m is what tells them apart, and is not looked at.
  ShapeWorld yard = world;
  yard.boxes.resize(3);
  for (const double yaw_rad : {0.3, -2.0}) {
    const Pose truth = UprightPose({-19.0, 0.5, 1.8}, yaw_rad);
    EXPECT_FALSE(Find(relocalizer, yard, truth).T_world_sensor) << "as good as 40 m away";
    PlacePrior prior;
    prior.center = truth.translation().head<2>() + Eigen::Vector2d(3.0, -2.0);
    prior.radius_m = 10.0;
    const Relocalization told = Find(relocalizer, yard, truth, prior);
    ASSERT_TRUE(told.T_world_sensor);
    EXPECT_LT(ErrorOf(*told.T_world_sensor, truth).horizontal_m, 0.1);
  }
}

// Between two walls without anything else the place along them is anybody's guess, even if no other
// explains more.
TEST(RelocalizerTest, WhatNothingHoldsItDoesNotKnow) {
  PaintedMap map;
  map.Paint(testing::Corridor(), 30.0);
  RelocalizerOptions options;
  options.features.max_range_m = 15.0F;
  options.min_margin = 0.0;
  const Relocalizer relocalizer(map.profile(), PlacesOf(map), map.Source(), options);
  const Relocalization found =
      Find(relocalizer, testing::Corridor(), UprightPose({3.0, 0.2, 1.8}, 0.1));
  ASSERT_FALSE(found.places.empty());
  EXPECT_GT(found.places.front().registration.fit, 0.6);
  EXPECT_FALSE(found.T_world_sensor);
}

TEST(RelocalizerTest, ElsewhereOrWithNothingToSeeItDoesNotKnow) {
  const Relocalizer street = RelocalizerIn(StreetMap());
  EXPECT_FALSE(
      Find(street, testing::GarageCorner(), UprightPose({0.5, 2.0, 1.8}, 0.7)).T_world_sensor);
  ShapeWorld plain;
  plain.patches = {testing::Patch{}};
  EXPECT_FALSE(Find(street, plain, UprightPose({0.0, 0.0, 1.8}, 0.0)).T_world_sensor);
  EXPECT_FALSE(street.Find(LeveledScan(), kLevel).value().T_world_sensor);
  PaintedMap nothing;
  EXPECT_FALSE(Find(RelocalizerIn(nothing), testing::Street(), UprightPose({0.0, 0.0, 1.8}, 0.0))
                   .T_world_sensor);
}

// The map around a place is loaded for those only that may be it.
TEST(RelocalizerTest, PlacesThatCarryFarLessThanTheBestAreNotRegistered) {
  const PaintedMap& map = StreetMap();
  const Pose truth = UprightPose({0.0, 0.0, 1.8}, 1.1);
  std::size_t loaded = 0;
  const auto counted = [&](const Eigen::Vector3d& center, double radius_m) {
    ++loaded;
    return map.Source()(center, radius_m);
  };
  std::vector<std::size_t> registered;
  for (const double share : {0.0, 0.5, 0.9, 1.0}) {
    RelocalizerOptions options;
    options.features.max_range_m = 25.0F;
    options.refined_share = share;
    loaded = 0;
    const auto found =
        Find({map.profile(), PlacesOf(map), counted, options}, testing::Street(), truth);
    registered.push_back(loaded);
    ASSERT_FALSE(found.places.empty());
    EXPECT_LT(ErrorOf(found.places[0].registration.T_world_level, truth).horizontal_m, 0.1)
        << share;
  }
  EXPECT_EQ(registered.front(), RelocalizerOptions().refined);
  EXPECT_TRUE(std::is_sorted(registered.rbegin(), registered.rend()));
  EXPECT_LT(registered.back(), registered.front());
}

TEST(RelocalizerTest, ErrorsOfTheTilesAreItsOwn) {
  const Relocalizer relocalizer(
      StreetMap().profile(), PlacesOf(StreetMap()),
      [](const Eigen::Vector3d&, double) -> Result<std::vector<std::shared_ptr<const Tile>>> {
        return Error(StatusCode::kUnavailable, "no daemon");
      });
  const auto found = relocalizer.Find(
      CastLeveledScan(testing::QuickSensor(), testing::Street(), UprightPose({0, 0, 1.8}, 0.0)),
      kLevel);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code(), StatusCode::kUnavailable);
}

TEST(PlaceIndexTest, PlacesStandOnEachDeckAndLookLikeWhatIsSeenThere) {
  const auto places = PlacesOf(GarageMap());
  const auto street = PlacesOf(StreetMap());
  for (const double yaw_rad : {0.0, 1.3}) {
    const Pose truth = UprightPose({3.0, 0.5, 1.83}, yaw_rad);
    const LeveledScan scan = CastLeveledScan(testing::QuickSensor(), testing::Street(), truth);
    const std::optional<double> ground_m = GroundBelow(scan);
    ASSERT_TRUE(ground_m);
    EXPECT_NEAR(*ground_m, -1.8, 0.15);
    const auto found = street->Find(ProfileOf(scan, *ground_m), -*ground_m, std::nullopt, 20, 1.5);
    ASSERT_EQ(found.size(), 20U);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end(), [](const auto& a, const auto& b) {
      return a.difference < b.difference;
    }));
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const PlaceCandidate& place) {
      const double turn = std::remainder(place.yaw_rad - yaw_rad, 2.0 * std::numbers::pi);
      return (place.ground.head<2>() - truth.translation().head<2>()).norm() < 2.5 &&
             std::abs(turn) < 0.15;
    })) << yaw_rad;
  }
}

}  // namespace
}  // namespace atlas
