// Routes written as GeoJSON and CSV, read again, and what is none.
#include "client/cli/files/route_file.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <boost/json/parse.hpp>
#include <gtest/gtest.h>

#include "client/cli/commands/map/route_text.h"
#include "client/cli/files/whole_file.h"

namespace atlas {
namespace {

class RouteFileTest : public ::testing::Test {
 protected:
  RouteFileTest() {
    std::string name = (std::filesystem::temp_directory_path() / "route_XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    route_.found = true;
    route_.waypoints = {{1.5, -2.25, 0.125}, {2.0, -2.0, 0.25}, {1e6, 3.0, -4.0}};
    route_.clearance_m = {1.5, 1.2, 1.1};
    route_.slope_deg = {0.0, 3.5, 24.0};
    route_.start = RouteEnd{{1.5, -2.25, 0.125}, {1.5, -2.25, 0.125}, 0, 1};
    route_.goal = RouteEnd{{1e6, 2.0, -2.0}, {1e6, 3.0, -4.0}, 1, 3};
  }
  ~RouteFileTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& text) {
    const Status status = WriteWholeFile(folder_ / name, Bytes(text.begin(), text.end()));
    EXPECT_TRUE(status.ok()) << status.message();
    return folder_ / name;
  }

  std::string Text(RouteFormat format) const {
    return RouteText(route_, format, atlas_, profile_.cell_size_m());
  }

  std::filesystem::path folder_;
  Route route_;
  Bytes atlas_id_ = Bytes(16, 0xAB);
  MapProfile profile_;
  RouteAtlas atlas_ = RouteAtlasOf(atlas_id_, profile_);
};

TEST_F(RouteFileTest, BothFormatsAreReadAsTheyWereWritten) {
  for (const std::string name : {"a.geojson", "a.json", "a.csv"}) {
    const auto format = RouteFormatOf(name);
    ASSERT_TRUE(format.has_value());
    const auto read = ReadRoute(Write(name, Text(*format)));
    ASSERT_TRUE(read.has_value()) << read.error().message();
    EXPECT_EQ(read->waypoints, route_.waypoints) << name;
  }
}

TEST_F(RouteFileTest, ARouteThatEndsWhereItBeginsIsReadAsWell) {
  route_.waypoints.resize(1);
  route_.clearance_m.resize(1);
  route_.slope_deg.resize(1);
  for (const std::string name : {"a.geojson", "a.csv"}) {
    const auto read = ReadRoute(Write(name, Text(*RouteFormatOf(name))));
    ASSERT_TRUE(read.has_value()) << read.error().message();
    EXPECT_EQ(read->waypoints, route_.waypoints) << name;
  }
}

TEST_F(RouteFileTest, EndsThatWereMovedSaySoAndOthersDoNot) {
  const auto properties =
      boost::json::parse(Text(RouteFormat::kGeoJson)).at("properties").as_object();
  EXPECT_FALSE(properties.contains("start"));
  const auto& goal = properties.at("goal").as_object();
  EXPECT_EQ(goal.at("asked"), (boost::json::array{1'000'000, 2, -2}));
  EXPECT_EQ(goal.at("at"), (boost::json::array{1'000'000, 3, -4}));
  EXPECT_DOUBLE_EQ(goal.at("aside_m").to_number<double>(), 1.0);
  EXPECT_DOUBLE_EQ(goal.at("above_m").to_number<double>(), -2.0);
  EXPECT_EQ(goal.at("layer").to_number<int>(), 1);
  EXPECT_EQ(goal.at("layers").to_number<int>(), 3);
  EXPECT_TRUE(Text(RouteFormat::kCsv).starts_with("x_m,y_m,z_m,")) << "a table and nothing else";
}

TEST_F(RouteFileTest, GeoJsonNamesItsAtlas) {
  const auto read = ReadRoute(Write("a.geojson", Text(RouteFormat::kGeoJson)));
  ASSERT_TRUE(read && read->atlas);
  EXPECT_EQ(*read->atlas, atlas_);
  EXPECT_EQ(read->atlas->id, "abababababababababababababababab");
  EXPECT_EQ(read->atlas->profile.size(), 16U);
  MapProfile coarser = profile_;
  coarser.cell_size_um *= 2;
  EXPECT_NE(*read->atlas, RouteAtlasOf(atlas_id_, coarser));
  EXPECT_FALSE(ReadRoute(Write("a.csv", Text(RouteFormat::kCsv)))->atlas);
  // What others put there is theirs.
  for (const std::string other : {"7", "{}", R"({"id":7,"profile":"x"})", R"({"id":"x"})"}) {
    const auto foreign = ReadRoute(
        Write("b.geojson", R"({"atlas":)" + other + R"(,"geometry":{"coordinates":[[1,2,3]]}})"));
    ASSERT_TRUE(foreign.has_value()) << other;
    EXPECT_FALSE(foreign->atlas) << other;
  }
}

TEST_F(RouteFileTest, OtherEndingsAreRefused) {
  for (const std::string name : {"a", "a.txt", "csv", ""}) {
    const auto format = RouteFormatOf(name);
    ASSERT_FALSE(format.has_value()) << name;
    EXPECT_EQ(format.error().code(), StatusCode::kInvalidArgument);
  }
}

TEST_F(RouteFileTest, WhatIsNoRouteIsInvalidData) {
  int i = 0;
  for (const std::string text :
       {"", "{}", "[1,2", R"({"geometry":null})", R"({"geometry":{"coordinates":[[1,2]]}})",
        R"({"geometry":{"coordinates":[]}})", R"({"geometry":{"type":"Point","coordinates":[]}})",
        R"({"geometry":{"type":"Point","coordinates":[[1,2,3]]}})",
        R"({"geometry":{"coordinates":[[1,2,"x"]]}})",
        R"({"geometry":{"coordinates":[[1,2,1e999]]}})"}) {
    const auto read = ReadRoute(Write(std::to_string(i++) + ".geojson", text));
    ASSERT_FALSE(read.has_value()) << text;
    EXPECT_EQ(read.error().code(), StatusCode::kInvalidData) << text;
  }
  for (const std::string text :
       {"", "1,2,3\n", "x_m,y_m,z_m\n", "x_m,y_m,z_m\n1;2;3\n", "x_m,y_m,z_m\n1,2,3\nnan,0,0\n"}) {
    const auto read = ReadRoute(Write(std::to_string(i++) + ".csv", text));
    ASSERT_FALSE(read.has_value()) << text;
    EXPECT_EQ(read.error().code(), StatusCode::kInvalidData) << text;
  }
  EXPECT_EQ(ReadRoute(folder_ / "none.csv").error().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace atlas
