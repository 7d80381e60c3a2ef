// Scans that were found in a map, and the transform that they tell.
#include "client/drive/anchor/anchor_fit.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Pose PoseAt(double x_m, double y_m, double z_m, double yaw_deg, double tilt_deg = 0.0) {
  Pose pose = Pose::Identity();
  pose.linear() = (Eigen::AngleAxisd(yaw_deg * kDegree, Eigen::Vector3d::UnitZ()) *
                   Eigen::AngleAxisd(tilt_deg * kDegree, Eigen::Vector3d(0.6, 0.8, 0.0)))
                      .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  return pose;
}

LevelTransform Somewhere() {
  return {-160.0 * kDegree, {1'234.5, -678.9, 31.0}};
}

// Scans along a bend, found where `truth` puts them but for noise of one sigma.
std::vector<FoundScan> Found(const LevelTransform& truth,
                             std::size_t count,
                             double noise_m,
                             double noise_deg,
                             std::uint32_t seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<FoundScan> found;
  for (std::size_t i = 0; i < count; ++i) {
    const auto s = static_cast<double>(i);
    FoundScan scan;
    scan.T_drive_sensor = PoseAt(5.0 * s, 0.1 * s * s, 0.05 * s, 2.0 * s, 1.5);
    scan.T_map_sensor = truth.ToPose() * scan.T_drive_sensor;
    scan.T_map_sensor.translation() +=
        noise_m * Eigen::Vector3d(normal(random), normal(random), normal(random));
    scan.T_map_sensor.linear() =
        Eigen::AngleAxisd(noise_deg * kDegree * normal(random), Eigen::Vector3d::UnitZ()) *
        scan.T_map_sensor.linear();
    found.push_back(scan);
  }
  return found;
}

double YawOff(const LevelTransform& a, const LevelTransform& b) {
  return std::abs(std::remainder(a.yaw_rad - b.yaw_rad, 2.0 * std::numbers::pi));
}

TEST(LevelTransformTest, TakesOneFrameToTheOtherWhateverTheTilt) {
  for (const double yaw_deg : {-179.9, -90.0, 0.0, 12.0, 180.0}) {
    const LevelTransform truth{yaw_deg * kDegree, {-3.0, 4.0, 5.0}};
    const Pose T_drive_sensor = PoseAt(100.0, -50.0, 2.0, 33.0, 14.0);
    const LevelTransform told =
        LevelTransformBetween(truth.ToPose() * T_drive_sensor, T_drive_sensor);
    EXPECT_LT(YawOff(told, truth), 1e-12);
    EXPECT_LT((told.shift_m - truth.shift_m).norm(), 1e-9);
  }
}

TEST(LevelTransformTest, AResidualTiltIsLeftOutAtTheSensor) {
  const Pose T_drive_sensor = PoseAt(1'000.0, 0.0, 0.0, 20.0);
  Pose T_map_sensor = Somewhere().ToPose() * T_drive_sensor;
  T_map_sensor.linear() =
      Eigen::AngleAxisd(1.0 * kDegree, Eigen::Vector3d::UnitY()) * T_map_sensor.linear();
  const LevelTransform told = LevelTransformBetween(T_map_sensor, T_drive_sensor);
  EXPECT_LT((told.ToPose() * T_drive_sensor.translation() - T_map_sensor.translation()).norm(),
            1e-9);
  EXPECT_LT(YawOff(told, Somewhere()), 0.02 * kDegree);
}

TEST(AgreementTest, ScansOfOneTransformAgreeAndOthersDoNot) {
  std::vector<FoundScan> found = Found(Somewhere(), 8, 0.03, 0.1);
  EXPECT_EQ(LargestAgreement(found, {}).size(), 8U);
  found[2].T_map_sensor.translation().x() += 1.5;
  found[5].T_map_sensor.translation().z() += 5.5;  // another deck
  found[6].T_map_sensor.linear() =
      Eigen::AngleAxisd(5.0 * kDegree, Eigen::Vector3d::UnitZ()) * found[6].T_map_sensor.linear();
  EXPECT_EQ(LargestAgreement(found, {}), (std::vector<std::size_t>{0, 1, 3, 4, 7}));
  EXPECT_TRUE(LargestAgreement({}, {}).empty());
}

// Each alone is as far off as the drive is bent on the way to the others.
TEST(AgreementTest, DriftIsBelievedAlongTheWay) {
  std::vector<FoundScan> found = Found(Somewhere(), 20, 0.0, 0.0);
  for (FoundScan& scan : found) {
    const double way_m = scan.T_drive_sensor.translation().norm();
    scan.T_map_sensor.translation().x() += 0.008 * way_m;
  }
  EXPECT_EQ(LargestAgreement(found, {}).size(), 20U);
  EXPECT_LT(LargestAgreement(found, {.drift = 0.001}).size(), 20U);
}

TEST(AnchorFitTest, FindsTheTransform) {
  for (const std::size_t count : {1U, 2U, 3U, 40U}) {
    const LevelTransform fit = FitTransform(Found(Somewhere(), count, 0.0, 0.0));
    EXPECT_LT((fit.shift_m - Somewhere().shift_m).norm(), 1e-6) << count;
    EXPECT_LT(YawOff(fit, Somewhere()), 1e-9);
  }
}

TEST(AnchorFitTest, Averages) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const auto found = Found(Somewhere(), 100, 0.05, 0.1, seed);
    const LevelTransform fit = FitTransform(found);
    for (const FoundScan& scan : found) {
      const Eigen::Vector3d& p = scan.T_drive_sensor.translation();
      EXPECT_LT((fit.ToPose() * p - Somewhere().ToPose() * p).norm(), 0.04);
    }
  }
}

TEST(AnchorFitTest, AFewWrongOnesDoNotPullIt) {
  std::vector<FoundScan> found = Found(Somewhere(), 40, 0.02, 0.05);
  for (std::size_t i = 0; i < 8; ++i) {
    found[5 * i].T_map_sensor.translation() += Eigen::Vector3d(0.45, 0.0, 0.1);
  }
  const LevelTransform fit = FitTransform(found);
  const Eigen::Vector3d& p = found[20].T_drive_sensor.translation();
  EXPECT_LT((fit.ToPose() * p - Somewhere().ToPose() * p).norm(), 0.03);
}

// All at one place: the headings alone say how it is turned.
TEST(AnchorFitTest, ADriveThatStandsIsTurnedByItsHeadings) {
  std::vector<FoundScan> found = Found(Somewhere(), 30, 0.0, 0.05);
  for (FoundScan& scan : found) {
    scan.T_drive_sensor.translation() = Eigen::Vector3d(7.0, 8.0, 9.0);
    scan.T_map_sensor.translation() = Somewhere().ToPose() * Eigen::Vector3d(7.0, 8.0, 9.0);
  }
  const LevelTransform fit = FitTransform(found);
  EXPECT_LT(YawOff(fit, Somewhere()), 0.03 * kDegree);
  EXPECT_LT(OffsetFrom(fit, found.front()).place_m.norm(), 1e-6);
}

}  // namespace
}  // namespace atlas
