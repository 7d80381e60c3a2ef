#include "core/fusion/observation/keyframe_placement.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/core/support/keyframe_worlds.h"

namespace atlas {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kScale = 1 << 30;

std::array<std::int32_t, 4> Quantize(const Eigen::Quaterniond& q) {
  Pose pose = Pose::Identity();
  pose.linear() = q.toRotationMatrix();
  return QuantizedPose::FromPose(pose).quaternion;
}

Eigen::Quaterniond About(const Eigen::Vector3d& axis, double degrees) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(degrees * kPi / 180.0, axis.normalized()));
}

QuantizedPose PoseOf(const Eigen::Quaterniond& rotation) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation.toRotationMatrix();
  pose.translation() = Eigen::Vector3d(12.5, -7.25, 1.0);
  return QuantizedPose::FromPose(pose);
}

// The largest difference between the placement's numbers and those of doubles.
double DeviationFromDoubles(const KeyframePlacement& placement, const Eigen::Matrix3d& m) {
  const double norm = std::hypot(m(0, 0), m(1, 0));
  return std::max({std::abs(placement.cos_yaw / kScale - m(0, 0) / norm),
                   std::abs(placement.sin_yaw / kScale - m(1, 0) / norm),
                   std::abs(placement.slope_x / kScale - m(2, 0)),
                   std::abs(placement.slope_y / kScale - m(2, 1))});
}

TEST(KeyframePlacementTest, AgreesWithDoubles) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-180.0, 180.0);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 2'000; ++i) {
    // A ramp of up to 20 degrees, any heading, up to 1.9 degrees of correction since.
    const Eigen::Quaterniond level = About({unit(random), unit(random), 0.0}, 20.0 * unit(random));
    const Eigen::Quaterniond tilt = About({unit(random), unit(random), 0.0}, 1.9 * unit(random));
    const Eigen::Quaterniond pose = About({0.0, 0.0, 1.0}, angle(random)) * tilt * level;
    const auto placement = PlaceKeyframe(PoseOf(pose), Quantize(level));
    ASSERT_TRUE(placement.has_value()) << placement.error().message();
    const Eigen::Matrix3d m = (pose * level.conjugate()).toRotationMatrix();
    EXPECT_LT(DeviationFromDoubles(*placement, m), 1e-8);
  }
}

TEST(KeyframePlacementTest, KeepsThePosition) {
  const auto placement = PlaceKeyframe(PoseOf(About({0.0, 0.0, 1.0}, 30.0)), {1 << 30, 0, 0, 0});
  ASSERT_TRUE(placement.has_value());
  EXPECT_EQ(placement->x_um, 12'500'000);
  EXPECT_EQ(placement->y_um, -7'250'000);
  EXPECT_EQ(placement->z_um, 1'000'000);
}

TEST(KeyframePlacementTest, TheLevelOfItsOwnPoseLeavesNoTilt) {
  const Eigen::Quaterniond pose = About({0.0, 0.0, 1.0}, 77.0) * About({1.0, 2.0, 0.0}, 18.5);
  const auto placement = PlaceKeyframe(PoseOf(pose), Quantize(SplitYaw(pose).R_level_sensor));
  ASSERT_TRUE(placement.has_value());
  EXPECT_LE(std::abs(placement->slope_x), 4);
  EXPECT_LE(std::abs(placement->slope_y), 4);
}

TEST(KeyframePlacementTest, RefusesMoreThanTwoDegreesOfTilt) {
  const auto tilted = [](double degrees) {
    return PlaceKeyframe(PoseOf(About({0.6, 0.8, 0.0}, degrees)), {1 << 30, 0, 0, 0});
  };
  EXPECT_TRUE(tilted(1.9999).has_value());
  EXPECT_TRUE(tilted(-1.9999).has_value());
  const auto refused = tilted(2.0001);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(refused.error().message().find("upload it levelled"), std::string::npos);
  EXPECT_FALSE(tilted(180.0).has_value());
}

TEST(KeyframePlacementTest, RefusesQuaternionsThatAreNotRotations) {
  const QuantizedPose pose;
  EXPECT_FALSE(PlaceKeyframe(pose, {0, 0, 0, 0}).has_value());
  EXPECT_FALSE(PlaceKeyframe(pose, {1 << 29, 0, 0, 0}).has_value());
  EXPECT_FALSE(PlaceKeyframe(pose, {INT32_MIN, INT32_MIN, INT32_MIN, INT32_MIN}).has_value());
}

// All tiles of 1.6 m within 35 of the origin that the disc touches, by doubles.
std::set<TileId> TouchedTiles(const KeyframePlacement& placement, double radius_m) {
  const double x_m = 1e-6 * static_cast<double>(placement.x_um);
  const double y_m = 1e-6 * static_cast<double>(placement.y_um);
  std::set<TileId> touched;
  for (std::int32_t y = -35; y < 35; ++y) {
    for (std::int32_t x = -35; x < 35; ++x) {
      const double dx = std::max({1.6 * x - x_m, x_m - 1.6 * (x + 1), 0.0});
      const double dy = std::max({1.6 * y - y_m, y_m - 1.6 * (y + 1), 0.0});
      if (std::hypot(dx, dy) <= radius_m) {
        touched.insert({0, x, y});
      }
    }
  }
  return touched;
}

TEST(FootprintTest, HoldsExactlyTheTilesTheDiscTouches) {
  MapProfile profile;
  profile.tile_cells = 16;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> position(-40.0, 40.0);
  for (int i = 0; i < 50; ++i) {
    const KeyframePlacement placement = testing::PlaceAt({position(random), position(random)});
    const std::int32_t radius = 1 + static_cast<std::int32_t>(random() % 60);
    const auto tiles = FootprintTiles(placement, {profile.cell_size_um, radius}, profile);
    const std::set<TileId> found(tiles.begin(), tiles.end());
    EXPECT_EQ(found, TouchedTiles(placement, 0.1 * radius));
    EXPECT_EQ(found.size(), tiles.size());
    EXPECT_TRUE(std::is_sorted(tiles.begin(), tiles.end(),
                               [](const auto& a, const auto& b) { return a.Key() < b.Key(); }));
  }
}

}  // namespace
}  // namespace atlas
