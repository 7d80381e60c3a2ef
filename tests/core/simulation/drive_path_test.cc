// Lengths, turns, offsets and reversal of paths.
#include "core/simulation/drive_path.h"

#include <numbers>

#include <gtest/gtest.h>

#include "core/simulation/worlds/props.h"

namespace atlas {
namespace {

constexpr double kPi = std::numbers::pi;

DrivePath Hook() {
  DrivePath path({{1.0, 2.0, 0.5}, 0.0});
  path.Straight(10.0, 1.0).Turn(5.0, kPi / 2.0).Straight(4.0);
  return path;
}

TEST(DrivePathTest, LengthIsThatOfItsPiecesInPlan) {
  EXPECT_NEAR(Hook().length_m(), 10.0 + 5.0 * kPi / 2.0 + 4.0, 1e-2);
}

TEST(DrivePathTest, EndsWhereThePiecesLead) {
  const PathPoint end = Hook().At(1e9);
  EXPECT_TRUE(end.position.isApprox(Eigen::Vector3d(16.0, 11.0, 1.5), 1e-9));
  EXPECT_NEAR(end.yaw_rad, kPi / 2.0, 1e-12);
}

TEST(DrivePathTest, ClimbsEvenlyAndOffsetsToTheLeft) {
  const PathPoint middle = Hook().At(5.0, 2.0);
  EXPECT_TRUE(middle.position.isApprox(Eigen::Vector3d(6.0, 4.0, 1.0), 1e-9));
}

TEST(DrivePathTest, RightTurnBendsRight) {
  DrivePath path({{0.0, 0.0, 0.0}, 0.0});
  const PathPoint end = path.Turn(3.0, -kPi).At(1e9);
  EXPECT_TRUE(end.position.isApprox(Eigen::Vector3d(0.0, -6.0, 0.0), 1e-9));
}

TEST(DrivePathTest, ReversedVisitsTheSamePointsBackwards) {
  const DrivePath path = Hook();
  const DrivePath back = path.Reversed();
  ASSERT_NEAR(back.length_m(), path.length_m(), 1e-9);
  for (const double along_m : EvenlySpaced(0.0, path.length_m(), 0.7)) {
    const PathPoint there = path.At(along_m, 1.0);
    const PathPoint here = back.At(path.length_m() - along_m, -1.0);
    EXPECT_TRUE(there.position.isApprox(here.position, 1e-9)) << along_m;
    EXPECT_NEAR(here.yaw_rad - there.yaw_rad, kPi, 1e-9) << along_m;
  }
}

}  // namespace
}  // namespace atlas
