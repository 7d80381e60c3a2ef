// Contradictions written as CSV and GeoJSON, read again, and what is none.
#include "client/cli/files/contradiction_file.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include <boost/json/parse.hpp>
#include <gtest/gtest.h>

#include "client/cli/files/whole_file.h"

namespace atlas {
namespace {

constexpr double kCell_m = 0.2;

std::vector<Contradiction> Some() {
  Contradiction box;
  box.cell_x = 12;
  box.cell_y = -7;
  box.altitude_mm = -1'250;
  box.low_mm = -1'000;
  box.high_mm = 1'000;
  box.hits = 9;
  box.passes = 1;
  box.first_scan = 3;
  box.last_scan = 21;
  box.score = 19.125;
  Contradiction wall = box;
  wall.kind = ContradictionKind::kVanished;
  wall.cell_x = -5'000'000;
  Contradiction car = box;
  car.kind = ContradictionKind::kMoving;
  return {box, wall, car};
}

class ContradictionFileTest : public ::testing::Test {
 protected:
  ContradictionFileTest() {
    std::string name = (std::filesystem::temp_directory_path() / "contradictions_XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~ContradictionFileTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& text) {
    const Status status = WriteTextFile(folder_ / name, text);
    EXPECT_TRUE(status.ok()) << status.message();
    return folder_ / name;
  }

  std::filesystem::path folder_;
};

TEST_F(ContradictionFileTest, BothFormatsAreReadAsTheyWereWritten) {
  for (const std::string name : {"a.geojson", "a.json", "a.csv", "none.csv", "none.geojson"}) {
    const auto format = ContradictionFormatOf(name);
    ASSERT_TRUE(format.has_value());
    const auto some = name.starts_with("none") ? std::vector<Contradiction>() : Some();
    const auto read = ReadContradictions(Write(name, ContradictionText(*format, some, kCell_m)));
    ASSERT_TRUE(read.has_value()) << read.error().message();
    ASSERT_EQ(read->size(), some.size()) << name;
    for (std::size_t i = 0; i < some.size(); ++i) {
      EXPECT_EQ((*read)[i].kind, some[i].kind);
      EXPECT_NEAR((*read)[i].center_m.x(), kCell_m * (static_cast<double>(some[i].cell_x) + 0.5),
                  1e-6);
      EXPECT_NEAR((*read)[i].center_m.y(), -1.3, 1e-6);
    }
  }
}

TEST_F(ContradictionFileTest, ALineOfTheCsvHasWhatItsFirstLineNames) {
  const std::string text = ContradictionText(ContradictionFormat::kCsv, Some(), kCell_m);
  EXPECT_TRUE(
      text.starts_with("kind,x_m,y_m,layer_m,low_m,high_m,hits,passes,first_scan,last_scan,score\n"
                       "appeared,2.500,-1.300,-1.250,-1.000,1.000,9,1,3,21,19.1"))
      << text;
}

TEST_F(ContradictionFileTest, TheGeoJsonIsACollectionOfPoints) {
  const auto root =
      boost::json::parse(ContradictionText(ContradictionFormat::kGeoJson, Some(), kCell_m));
  EXPECT_EQ(root.at("type").as_string(), "FeatureCollection");
  const auto& wall = root.at("features").as_array().at(1);
  EXPECT_EQ(wall.at("geometry").at("type").as_string(), "Point");
  EXPECT_EQ(wall.at("properties").at("kind").as_string(), "vanished");
  EXPECT_EQ(wall.at("properties").at("hits").as_int64(), 9);
}

TEST_F(ContradictionFileTest, OtherEndingsAreRefused) {
  for (const std::string name : {"a", "a.txt", "csv", "", "a.csv.gz"}) {
    const auto format = ContradictionFormatOf(name);
    ASSERT_FALSE(format.has_value()) << name;
    EXPECT_EQ(format.error().code(), StatusCode::kInvalidArgument);
  }
}

TEST_F(ContradictionFileTest, OtherContentIsInvalidData) {
  const std::string columns = ContradictionText(ContradictionFormat::kCsv, {}, kCell_m);
  int i = 0;
  for (const std::string& text :
       {std::string(), std::string("x_m,y_m\n1,2\n"), columns + "grown,1,2,3,4,5,6,7,8,9,1\n",
        columns + "appeared,one,2\n", columns + "appeared,1\n", columns + "appeared,1e999,1\n"}) {
    const auto read = ReadContradictions(Write(std::to_string(i++) + ".csv", text));
    ASSERT_FALSE(read.has_value()) << text;
    EXPECT_EQ(read.error().code(), StatusCode::kInvalidData);
  }
  for (const std::string text :
       {"", "{}", "[", R"({"features":{}})", R"({"features":[{}]})",
        R"({"features":[{"properties":{"kind":"grown"},"geometry":{"coordinates":[1,2,3]}}]})",
        R"({"features":[{"properties":{"kind":"moving"},"geometry":{"coordinates":[1]}}]})",
        R"({"features":[{"properties":{"kind":"moving"},"geometry":{"coordinates":["1",2]}}]})"}) {
    const auto read = ReadContradictions(Write(std::to_string(i++) + ".geojson", text));
    ASSERT_FALSE(read.has_value()) << text;
    EXPECT_EQ(read.error().code(), StatusCode::kInvalidData);
  }
  EXPECT_EQ(ReadContradictions(folder_ / "none.csv").error().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace atlas
