// What is written of scans that were found, and of those that were not.
#include "client/drive/relocalization_file.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/drive/track_file.h"
#include "tests/client/drive/split.h"

namespace atlas {
namespace {

using testing::Split;

// By the columns' names.
std::map<std::string, std::string> RowOf(const RelocalizedScan& scan) {
  const auto lines = Split(RelocalizationText(std::vector{scan}), '\n');
  const auto names = Split(lines.at(0), ',');
  const auto fields = Split(lines.at(1), ',');
  EXPECT_EQ(lines.size(), 2U);
  EXPECT_EQ(names.size(), fields.size());
  std::map<std::string, std::string> row;
  for (std::size_t i = 0; i < names.size() && i < fields.size(); ++i) row[names[i]] = fields[i];
  return row;
}

RelocalizedScan Found() {
  RelocalizedScan scan;
  scan.scan = 42;
  scan.time_s = 1'700'000'000.125;
  scan.found.T_world_sensor = Pose::Identity();
  scan.found.T_world_sensor->translation() = Eigen::Vector3d(4'429'876.543, -2.25, 1.8);
  scan.found.places.resize(2);
  scan.found.places[0].registration.fit = 0.75;
  scan.found.places[0].explained = 0.5;
  scan.found.margin = 0.125;
  scan.error = {0.5, 1.5};
  scan.offset = {0.3, -0.4, 0.01, std::numbers::pi / 180.0};
  return scan;
}

TEST(RelocalizationFileTest, AFoundScanHasItsPoseMarginAndError) {
  auto row = RowOf(Found());
  EXPECT_EQ(row["scan"], "42");
  EXPECT_EQ(row["time_s"], "1700000000.125000");
  EXPECT_EQ(row["x_m"], "4429876.543000");
  EXPECT_EQ(row["qw"], "1.000000000");
  EXPECT_EQ(row["error_m"], "0.500000");
  EXPECT_EQ(row["across_m"], "-0.400000");
  EXPECT_EQ(row["yaw_deg"], "1.000000");
  EXPECT_EQ(row["health"], "good");
  EXPECT_EQ(row["fit"], "0.7500");
  EXPECT_EQ(row["explained"], "0.5000");
  EXPECT_EQ(row["margin"], "0.1250");
  EXPECT_EQ(row["places"], "2");
}

TEST(RelocalizationFileTest, DontKnowIsLostAndHasNoPose) {
  RelocalizedScan unknown = Found();
  unknown.found.T_world_sensor.reset();
  auto row = RowOf(unknown);
  EXPECT_EQ(row["health"], "lost");
  EXPECT_EQ(row["x_m"], "");
  EXPECT_EQ(row["qw"], "");
  EXPECT_EQ(row["error_m"], "0.500000") << "of what was likeliest";
  unknown.found.places.clear();
  unknown.time_s.reset();
  row = RowOf(unknown);
  EXPECT_EQ(row["time_s"], "");
  EXPECT_EQ(row["error_m"], "");
  EXPECT_EQ(row["fit"], "");
  EXPECT_EQ(row["places"], "0");
}

TEST(RelocalizationFileTest, ColumnsOfATrackHaveTheSameNames) {
  const auto tracked = Split(Split(TrackText(TrackFormat::kCsv, {}), '\n').at(0), ',');
  auto row = RowOf(Found());
  for (const std::string own : {"explained", "margin", "places"}) row.erase(own);
  for (const auto& [name, value] : row) {
    EXPECT_NE(std::find(tracked.begin(), tracked.end(), name), tracked.end()) << name;
  }
}

}  // namespace
}  // namespace atlas
