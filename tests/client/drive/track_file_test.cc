// The three formats of a track, read back.
#include "client/drive/track_file.h"

#include <algorithm>
#include <array>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/client/drive/split.h"

namespace atlas {
namespace {

using testing::Split;

LocalizedScan Sample() {
  LocalizedScan scan;
  scan.scan = 42;
  scan.trial = 3;
  scan.time_s = 1'700'000'000.125;
  scan.located.T_world_sensor.translation() = Eigen::Vector3d(4'429'876.543, -2.25, 1.8);
  scan.located.T_world_sensor.linear() =
      Eigen::AngleAxisd(std::numbers::pi / 2.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  scan.located.health = LocalizationHealth::kWeak;
  scan.located.fit = 0.75;
  scan.error = {0.5, 1.5};
  scan.offset = {0.3, -0.4, 0.01, std::numbers::pi / 180.0};
  scan.covariance = Eigen::Vector4d(0.04, 0.01, 0.0001, 0.0).asDiagonal();
  scan.normalized_square = 2.5;
  scan.is_after_jump = true;
  return scan;
}

TEST(TrackFileTest, CsvNamesItsColumns) {
  const auto lines = Split(TrackText(TrackFormat::kCsv, std::vector{Sample(), Sample()}), '\n');
  ASSERT_EQ(lines.size(), 3U);
  const auto names = Split(lines[0], ',');
  const auto fields = Split(lines[1], ',');
  ASSERT_EQ(names.size(), fields.size());
  const auto field = [&](const std::string& name) {
    const auto at = std::find(names.begin(), names.end(), name);
    return at == names.end() ? "no such column"
                             : fields[static_cast<std::size_t>(at - names.begin())];
  };
  EXPECT_EQ(field("scan"), "42");
  EXPECT_EQ(field("trial"), "3");
  EXPECT_EQ(field("time_s"), "1700000000.125000");
  EXPECT_EQ(field("x_m"), "4429876.543000");
  EXPECT_EQ(field("qz"), "0.707106781");
  EXPECT_EQ(field("along_m"), "0.300000");
  EXPECT_EQ(field("across_m"), "-0.400000");
  EXPECT_EQ(field("up_m"), "0.010000");
  EXPECT_EQ(field("yaw_deg"), "1.000000");
  EXPECT_EQ(field("health"), "weak");
  EXPECT_EQ(field("fit"), "0.7500");
  EXPECT_EQ(field("sigma_along_m"), "0.200000");
  EXPECT_EQ(field("sigma_up_m"), "0.010000");
  EXPECT_EQ(field("nees"), "2.5000");
  EXPECT_EQ(field("restart"), "1");
}

TEST(TrackFileTest, WhatIsNotKnownIsEmpty) {
  LocalizedScan scan = Sample();
  scan.time_s.reset();
  scan.covariance.reset();
  scan.normalized_square.reset();
  const std::string text = TrackText(TrackFormat::kCsv, std::vector{scan});
  EXPECT_NE(text.find("42,3,,"), std::string::npos);
  EXPECT_NE(text.find("weak,0.7500,,,,,,1\n"), std::string::npos);
}

TEST(TrackFileTest, TumIsTimePlaceAndQuaternion) {
  const auto fields = Split(TrackText(TrackFormat::kTum, std::vector{Sample()}), ' ');
  ASSERT_EQ(fields.size(), 8U);
  EXPECT_EQ(fields[0], "1700000000.125000");
  EXPECT_DOUBLE_EQ(std::stod(fields[2]), -2.25);
  EXPECT_NEAR(std::stod(fields[6]), std::numbers::sqrt2 / 2.0, 1e-9);
  EXPECT_NEAR(std::stod(fields[7]), std::numbers::sqrt2 / 2.0, 1e-9);
  LocalizedScan timeless = Sample();
  timeless.time_s.reset();
  EXPECT_EQ(TrackText(TrackFormat::kTum, std::vector{timeless}).substr(0, 10), "42.000000 ");
}

TEST(TrackFileTest, WhereItIsLostTumHasNoPlaceAndKittiALine) {
  LocalizedScan lost = Sample();
  lost.located.health = LocalizationHealth::kLost;
  EXPECT_EQ(TrackText(TrackFormat::kTum, std::vector{lost}), "");
  EXPECT_EQ(Split(TrackText(TrackFormat::kKitti, std::vector{lost}), ' ').size(), 12U);
}

TEST(TrackFileTest, KittiIsAPoseARow) {
  const auto fields = Split(TrackText(TrackFormat::kKitti, std::vector{Sample()}), ' ');
  ASSERT_EQ(fields.size(), 12U);
  std::array<double, 12> numbers{};
  for (std::size_t i = 0; i < fields.size(); ++i) numbers[i] = std::stod(fields[i]);
  const auto pose = PoseFromRowMajor(numbers);
  ASSERT_TRUE(pose.has_value());
  EXPECT_TRUE(pose->isApprox(Sample().located.T_world_sensor, 1e-9));
}

TEST(TrackFileTest, FormatsAreKnownByTheirEnding) {
  EXPECT_EQ(TrackFormatOf("a/track.csv").value(), TrackFormat::kCsv);
  EXPECT_EQ(TrackFormatOf("TRACK.TUM").value(), TrackFormat::kTum);
  EXPECT_EQ(TrackFormatOf("x.kitti").value(), TrackFormat::kKitti);
  for (const char* name : {"track", "track.txt", "csv", ".csv", "track.csv.gz"}) {
    const auto format = TrackFormatOf(name);
    ASSERT_FALSE(format.has_value()) << name;
    EXPECT_EQ(format.error().code(), StatusCode::kInvalidArgument);
    EXPECT_NE(format.error().message().find(".kitti"), std::string::npos);
  }
}

}  // namespace
}  // namespace atlas
