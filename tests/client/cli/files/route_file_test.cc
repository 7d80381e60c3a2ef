// Routes written as GeoJSON and CSV, read again, and what is none.
#include "client/cli/files/route_file.h"

#include <cstdlib>
#include <filesystem>
#include <string>

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
  }
  ~RouteFileTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& text) {
    const Status status = WriteWholeFile(folder_ / name, Bytes(text.begin(), text.end()));
    EXPECT_TRUE(status.ok()) << status.message();
    return folder_ / name;
  }

  std::filesystem::path folder_;
  Route route_;
};

TEST_F(RouteFileTest, BothFormatsAreReadAsTheyWereWritten) {
  for (const std::string name : {"a.geojson", "a.json", "a.csv"}) {
    const auto format = RouteFormatOf(name);
    ASSERT_TRUE(format.has_value());
    const auto read = ReadRoute(Write(name, RouteText(route_, *format)));
    ASSERT_TRUE(read.has_value()) << read.error().message();
    EXPECT_EQ(*read, route_.waypoints) << name;
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
        R"({"geometry":{"coordinates":[]}})", R"({"geometry":{"coordinates":[[1,2,"x"]]}})",
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
