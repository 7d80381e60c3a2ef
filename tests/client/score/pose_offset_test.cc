#include "client/score/pose_offset.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

Pose At(double x_m, double y_m, double z_m, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  return pose;
}

TEST(PoseOffsetTest, IsSeenFromTheTruthsHeading) {
  const PoseOffset offset = OffsetOf(At(10.0, 5.3, 2.1, 92 * kDeg), At(10.2, 5.0, 2.0, 90 * kDeg));
  EXPECT_NEAR(offset.along_m, 0.3, 1e-12);  // y is ahead
  EXPECT_NEAR(offset.left_m, 0.2, 1e-12);
  EXPECT_NEAR(offset.up_m, 0.1, 1e-12);
  EXPECT_NEAR(offset.yaw_rad, 2 * kDeg, 1e-12);
}

TEST(PoseOffsetTest, TurnsTakeTheShortWay) {
  EXPECT_NEAR(OffsetOf(At(0, 0, 0, 179 * kDeg), At(0, 0, 0, -179 * kDeg)).yaw_rad, -2 * kDeg, 1e-9);
}

TEST(PoseOffsetTest, CovariancesTurnWithTheHeading) {
  const Eigen::Matrix4d covariance = Eigen::Vector4d(4.0, 1.0, 9.0, 0.5).asDiagonal();
  const Eigen::Matrix4d turned = AlongHeading(covariance, At(0, 0, 0, 90 * kDeg));
  EXPECT_NEAR(turned(0, 0), 1.0, 1e-12);
  EXPECT_NEAR(turned(1, 1), 4.0, 1e-12);
  EXPECT_NEAR(turned(2, 2), 9.0, 1e-12);
  EXPECT_NEAR(turned(3, 3), 0.5, 1e-12);
}

TEST(PoseOffsetTest, NormalizedSquareCountsInSigmas) {
  const Eigen::Matrix4d covariance = Eigen::Vector4d(0.04, 0.01, 0.25, 1e-4).asDiagonal();
  EXPECT_NEAR(NormalizedSquare({0.2, -0.2, 0.5, 0.03}, covariance), 1.0 + 4.0 + 1.0 + 9.0, 1e-9);
  EXPECT_TRUE(std::isinf(NormalizedSquare({0.1, 0, 0, 0}, Eigen::Matrix4d::Zero())));
}

}  // namespace
}  // namespace atlas
