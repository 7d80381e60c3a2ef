// A drive that fits nearly everywhere, and what is said of the rest.
#include "client/drive/anchor/frame_fit.h"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr FrameLimits kLimits{.rms_m = 0.12,
                              .rms_rad = 0.25 * kDegree,
                              .worst_rms_m = 0.18,
                              .worst_rms_rad = 0.4 * kDegree,
                              .longest_astray = 1,
                              .found_per_astray = 30};

LevelTransform Somewhere() {
  return {40.0 * kDegree, {100.0, -50.0, 3.0}};
}

// A straight drive of 100 m.
std::vector<FollowedScan> Right() {
  std::vector<FollowedScan> scans(100);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    FollowedScan& scan = scans[i];
    scan.index = i;
    scan.is_found = true;
    scan.scan.T_drive_sensor.translation().x() = static_cast<double>(i);
    scan.scan.T_map_sensor = Somewhere().ToPose() * scan.scan.T_drive_sensor;
  }
  return scans;
}

std::vector<FollowedScan> Off(std::size_t begin, std::size_t end, double m, double deg = 0.0) {
  std::vector<FollowedScan> scans = Right();
  for (std::size_t i = begin; i < end; ++i) {
    Pose& T_map_sensor = scans[i].scan.T_map_sensor;
    T_map_sensor.translation().z() += m;
    T_map_sensor.linear() =
        Eigen::AngleAxisd(deg * kDegree, Eigen::Vector3d::UnitZ()) * T_map_sensor.linear();
  }
  return scans;
}

std::vector<FollowedScan> Astray(std::size_t begin, std::size_t end, std::size_t step = 1) {
  std::vector<FollowedScan> scans = Right();
  for (std::size_t i = begin; i < end; i += step) {
    scans[i].is_found = false;
  }
  return scans;
}

FrameFit Measured(const std::vector<FollowedScan>& scans) {
  return MeasureFrame(scans, Somewhere());
}

TEST(FrameFitTest, ARightOneIsOffByNothing) {
  const FrameFit fit = Measured(Right());
  EXPECT_EQ(fit.tracked, 100U);
  EXPECT_EQ(fit.astray, 0U);
  EXPECT_LT(fit.worst_rms_m, 1e-9);
  EXPECT_LT(fit.worst_rms_rad, 1e-9);
  EXPECT_EQ(WhyBeyond(fit, kLimits), "");
  EXPECT_EQ(Measured({}).tracked, 0U);
}

TEST(FrameFitTest, AStretchThatIsOffIsNotLostInTheWhole) {
  for (const std::size_t begin : {0U, 45U, 90U}) {
    const FrameFit fit = Measured(Off(begin, begin + 10, 0.3));
    EXPECT_NEAR(fit.rms_m, 0.3 * std::sqrt(0.1), 1e-9) << "within its limit";
    EXPECT_LT(fit.rms_m, kLimits.rms_m);
    EXPECT_NEAR(fit.worst_rms_m, 0.3, 1e-9);
    EXPECT_NE(WhyBeyond(fit, kLimits).find("off the most"), std::string::npos);
  }
  EXPECT_NEAR(Measured(Off(98, 100, 0.3)).worst_rms_m, 0.3 * std::sqrt(0.2), 1e-9);
}

TEST(FrameFitTest, AStretchThatIsTurnedIsNotEither) {
  const FrameFit fit = Measured(Off(50, 60, 0.0, 0.7));
  EXPECT_NEAR(fit.worst_rms_rad, 0.7 * kDegree, 1e-9);
  EXPECT_LT(fit.rms_rad, kLimits.rms_rad);
  EXPECT_NE(WhyBeyond(fit, kLimits).find("off the most"), std::string::npos);
}

// A keyframe is made of how the drive says that its sensor was tilted.
TEST(FrameFitTest, WhatIsTiltedOtherwiseIsNot) {
  std::vector<FollowedScan> scans = Right();
  for (FollowedScan& scan : scans) {
    Pose& T_drive_sensor = scan.scan.T_drive_sensor;
    T_drive_sensor.linear() =
        T_drive_sensor.linear() * Eigen::AngleAxisd(1.6 * kDegree, Eigen::Vector3d::UnitX());
  }
  const FrameFit fit = Measured(scans);
  EXPECT_LT(fit.rms_m, 1e-9);
  EXPECT_NEAR(fit.rms_rad, 1.6 * kDegree, 1e-6);
  EXPECT_NE(WhyBeyond(fit, kLimits), "");
}

TEST(FrameFitTest, FewerThanAStretchAreOne) {
  std::vector<FollowedScan> scans = Off(0, 3, 0.3);
  scans.resize(3);
  EXPECT_NEAR(Measured(scans).worst_rms_m, 0.3, 1e-9);
}

TEST(FrameFitTest, TwoAstrayInARowAreAPartElsewhere) {
  EXPECT_EQ(WhyBeyond(Measured(Astray(99, 100)), kLimits), "");
  const FrameFit fit = Measured(Astray(98, 100));
  EXPECT_EQ(fit.astray, 2U);
  EXPECT_EQ(fit.longest_astray, 2U);
  EXPECT_NE(WhyBeyond(fit, kLimits).find("2 scans in a row"), std::string::npos);
}

TEST(FrameFitTest, AndSoAreManyAlone) {
  EXPECT_EQ(WhyBeyond(Measured(Astray(0, 100, 30)), kLimits), "") << "four of a hundred";
  EXPECT_NE(WhyBeyond(Measured(Astray(0, 100, 20)), kLimits).find("5 scans do not fit"),
            std::string::npos);
}

}  // namespace
}  // namespace atlas
