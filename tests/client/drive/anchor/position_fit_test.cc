// A drive whose poses and positions are known, moved against each other.
#include "client/drive/anchor/position_fit.h"

#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

struct World {
  std::vector<DriveScan> scans;
  std::vector<const DriveScan*> drive;
  KnownPlaces positions;
};

// 40 m along x, each other metre with a position that is `off_m` from where the drive's own poses
// have it.
World Make(const Eigen::Vector3d& off_m, double radius_m) {
  World world;
  for (std::uint32_t i = 0; i < 40; ++i) {
    DriveScan& scan = world.scans.emplace_back();
    scan.number = i;
    scan.T_world_sensor.translation().x() = i;
    if (i % 2 == 0) {
      world.positions[i] = {scan.T_world_sensor.translation() + off_m, radius_m};
    }
  }
  for (const DriveScan& scan : world.scans) {
    world.drive.push_back(&scan);
  }
  return world;
}

TEST(PositionFitTest, TheTransformIsFromWhereThePositionsAre) {
  const World world = Make({1.0, -2.0, 3.0}, 0.5);
  const PositionFit as_driven = FitPositions(world.drive, world.positions, {});
  EXPECT_EQ(as_driven.positions, 20U);
  EXPECT_NEAR((as_driven.off_m - Eigen::Vector3d(-1.0, 2.0, -3.0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(as_driven.radius_m, 0.5, 1e-9);
  const PositionFit moved = FitPositions(world.drive, world.positions, {0.0, {1.0, -2.0, 3.0}});
  EXPECT_NEAR(moved.off_m.norm(), 0.0, 1e-9);
  EXPECT_TRUE(WhyOff(moved).empty());
}

TEST(PositionFitTest, TwoStandardDeviationsAreAllowedAndHalfAMetre) {
  for (const int axis : {0, 1, 2}) {
    for (const double sign : {-1.0, 1.0}) {
      const auto why = [&](double off_m) {
        const World world = Make(sign * off_m * Eigen::Vector3d::Unit(axis), 1.0);
        return WhyOff(FitPositions(world.drive, world.positions, {}));
      };
      EXPECT_TRUE(why(2.4).empty()) << axis;
      EXPECT_NE(why(2.6).find("right to 1 m"), std::string::npos) << why(2.6);
      EXPECT_FALSE(why(3.2).empty()) << "another deck";
    }
  }
}

// As a receiver has them under a bridge.
TEST(PositionFitTest, SomeMayBeAnywhere) {
  World world = Make(Eigen::Vector3d::Zero(), 0.5);
  for (auto& [scan, place] : world.positions) {
    if (scan % 5 == 0) place.p_world += Eigen::Vector3d(300.0, -50.0, 40.0);
  }
  EXPECT_TRUE(WhyOff(FitPositions(world.drive, world.positions, {})).empty());
}

TEST(PositionFitTest, WhereThereAreNoneNothingIsOff) {
  const World world = Make(Eigen::Vector3d::Zero(), 0.5);
  const PositionFit fit = FitPositions(world.drive, {}, {0.0, {1e3, 0.0, 0.0}});
  EXPECT_EQ(fit.positions, 0U);
  EXPECT_TRUE(WhyOff(fit).empty());
}

TEST(PositionFitTest, AScanIsLookedForAroundItsPosition) {
  const PlacePrior prior = PriorOf({{10.0, -20.0, 5.0}, 2.0});
  EXPECT_EQ(prior.center, Eigen::Vector2d(10.0, -20.0));
  EXPECT_DOUBLE_EQ(prior.radius_m, 7.0);
  EXPECT_DOUBLE_EQ(prior.z_m, 5.0);
  EXPECT_DOUBLE_EQ(prior.height_m, 7.0);
  EXPECT_TRUE(prior.Validate().ok());
}

}  // namespace
}  // namespace atlas
