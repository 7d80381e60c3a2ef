#include "client/score/localization_score.h"

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

TEST(LocalizationScoreTest, FailuresAreCountedAndLeftOut) {
  LocalizationScore score;
  score.Add({0.3, 0.0}, false);
  score.Add({0.4, 2.0}, false);
  score.Add({1.01, 0.0}, false);  // too far
  score.Add({0.0, 5.01}, false);  // turned too far
  score.Add({0.0, 0.0}, true);    // right, but it does not know
  EXPECT_EQ(score.shots(), 5U);
  EXPECT_EQ(score.failures(), 3U);
  EXPECT_EQ(score.lost(), 1U);
  EXPECT_NEAR(score.translation_rmse_m(), std::sqrt((0.09 + 0.16) / 2.0), 1e-12);
  EXPECT_NEAR(score.rotation_rmse_deg(), std::sqrt(2.0), 1e-12);
}

TEST(LocalizationScoreTest, PercentileIsTheNearestRank) {
  LocalizationScore score;
  for (int i = 100; i >= 1; --i) {
    score.Add({i / 1000.0, 0.0}, false);
  }
  EXPECT_DOUBLE_EQ(score.translation_p95_m(), 0.095);
  LocalizationScore one;
  one.Add({0.2, 0.0}, false);
  EXPECT_DOUBLE_EQ(one.translation_p95_m(), 0.2);
  EXPECT_DOUBLE_EQ(LocalizationScore().translation_p95_m(), 0.0);
}

TEST(LocalizationScoreTest, ErrorIsDistanceAndAngle) {
  const PoseError error = ErrorOf(At(1, 2, 3, 10 * kDeg), At(1, 2, 5, 13 * kDeg));
  EXPECT_NEAR(error.translation_m, 2.0, 1e-12);
  EXPECT_NEAR(error.rotation_deg, 3.0, 1e-9);
}

}  // namespace
}  // namespace atlas
