// Drift grows with the way, as much as it is said to, and roll and pitch do not.
#include "core/simulation/pose_drift.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// A metre a pose, straight on.
std::vector<Pose> Straight(std::size_t poses) {
  std::vector<Pose> way(poses, Pose::Identity());
  for (std::size_t i = 0; i < poses; ++i) {
    way[i].translation().x() = static_cast<double>(i);
  }
  return way;
}

double YawOf(const Pose& pose) {
  return SplitYaw(Eigen::Quaterniond(pose.linear())).yaw_rad;
}

double TiltOf(const Pose& pose) {
  return std::acos(std::min(1.0, pose.linear()(2, 2)));
}

TEST(PoseDriftTest, GrowsWithTheWayWithinItsBounds) {
  const std::vector<Pose> truth = Straight(1001);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::vector<Pose> drifted = Drifted(truth, {.seed = seed});
    ASSERT_EQ(drifted.size(), truth.size());
    EXPECT_LT((drifted[0].translation() - truth[0].translation()).norm(), 1e-12);
    const double yaw_deg = std::abs(YawOf(drifted.back())) / kDegree;
    EXPECT_GT(yaw_deg, 2.0) << seed;
    EXPECT_LT(yaw_deg, 5.01) << seed;
    const double z_m = std::abs(drifted.back().translation().z());
    EXPECT_GT(z_m, 4.0) << seed;
    EXPECT_LT(z_m, 10.01) << seed;
    const double length_m = drifted.back().translation().norm();
    EXPECT_NEAR(length_m, 1000.0, 12.0) << seed;
    for (const Pose& pose : drifted) {
      EXPECT_LE(TiltOf(pose), 0.75 * kDegree) << seed;
    }
  }
}

TEST(PoseDriftTest, IsTheSameForASeedAndOfEitherSign) {
  const std::vector<Pose> truth = Straight(301);
  int left = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const std::vector<Pose> drifted = Drifted(truth, {.seed = seed});
    EXPECT_TRUE(drifted.back().isApprox(Drifted(truth, {.seed = seed}).back(), 0.0));
    left += YawOf(drifted.back()) > 0.0 ? 1 : 0;
  }
  EXPECT_GT(left, 8);
  EXPECT_LT(left, 32);
}

TEST(PoseDriftTest, TakesAJumpAsItIs) {
  std::vector<Pose> truth = Straight(20);
  for (std::size_t i = 10; i < truth.size(); ++i) {
    truth[i].translation().y() += 500.0;
  }
  const std::vector<Pose> drifted = Drifted(truth, {});
  const Eigen::Vector3d jump = drifted[10].translation() - drifted[9].translation();
  EXPECT_LT((jump - Eigen::Vector3d(1.0, 500.0, 0.0)).norm(), 1e-9);
}

TEST(PoseDriftTest, KeepsTheVehiclesAttitudeOnASlope) {
  std::vector<Pose> truth = Straight(200);
  for (Pose& pose : truth) {
    pose.linear() = Eigen::AngleAxisd(5.0 * kDegree, Eigen::Vector3d::UnitY()).toRotationMatrix();
  }
  for (const Pose& pose : Drifted(truth, {.seed = 3})) {
    EXPECT_NEAR(TiltOf(pose), 5.0 * kDegree, 0.75 * kDegree);
  }
}

TEST(PoseDriftTest, NamesAnOptionOutOfRange) {
  EXPECT_EQ(DriftOptions{.position = 2.0}.Validate().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(DriftOptions{.yaw_rad_a_m = -1.0}.Validate().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(DriftOptions{.tilt_rad = 1.0}.Validate().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(DriftOptions{.steady = 1.5}.Validate().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(DriftOptions{.wavelength_m = 0.0}.Validate().code(), StatusCode::kInvalidArgument);
  EXPECT_TRUE(DriftOptions{}.Validate().ok());
}

}  // namespace
}  // namespace atlas
