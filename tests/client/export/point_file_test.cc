// Point clouds read back by readers that know no more than the formats' descriptions say.
#include "client/export/point_file.h"

#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>

#include "core/geometry/nibble.h"

namespace atlas {
namespace {

static_assert(std::endian::native == std::endian::little);

struct ReadPoint {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  double probability = 0.0;
};

template <typename T>
double Take(const std::string& bytes, std::size_t& at) {
  T value{};
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  at += sizeof(T);
  return static_cast<double>(value);
}

// PCD 0.7: lines of a keyword and its values until DATA; "#" begins a comment.
std::vector<ReadPoint> ReadPcd(const std::string& bytes) {
  std::map<std::string, std::string> header;
  std::size_t at = 0;
  while (!header.contains("DATA")) {
    const std::size_t end = bytes.find('\n', at);
    const std::string line = bytes.substr(at, end - at);
    at = end + 1;
    if (line.starts_with('#')) continue;
    const std::size_t space = line.find(' ');
    header[line.substr(0, space)] = line.substr(space + 1);
  }
  EXPECT_EQ(header["VERSION"], "0.7");
  EXPECT_EQ(header["FIELDS"], "x y z intensity");
  EXPECT_EQ(header["SIZE"], "4 4 4 4");
  EXPECT_EQ(header["TYPE"], "F F F F");
  EXPECT_EQ(header["COUNT"], "1 1 1 1");
  EXPECT_EQ(header["HEIGHT"], "1");
  EXPECT_EQ(header["WIDTH"], header["POINTS"]);
  EXPECT_EQ(header["DATA"], "binary");
  const std::size_t count = std::stoul(header["POINTS"]);
  EXPECT_EQ(bytes.size(), at + 16 * count);
  std::vector<ReadPoint> points(count);
  for (ReadPoint& point : points) {
    point.x = Take<float>(bytes, at);
    point.y = Take<float>(bytes, at);
    point.z = Take<float>(bytes, at);
    point.probability = Take<float>(bytes, at);
  }
  return points;
}

// PLY 1.0: magic, format, elements with their properties, end_header.
std::vector<ReadPoint> ReadPly(const std::string& bytes) {
  const std::string end = "end_header\n";
  std::size_t at = bytes.find(end) + end.size();
  std::istringstream header(bytes.substr(0, at));
  std::string line;
  std::vector<std::string> lines;
  while (std::getline(header, line)) {
    if (!line.starts_with("comment")) lines.push_back(line);
  }
  EXPECT_EQ(lines.size(), 8U);
  EXPECT_EQ(lines[0], "ply");
  EXPECT_EQ(lines[1], "format binary_little_endian 1.0");
  EXPECT_EQ(lines[3], "property double x");
  EXPECT_EQ(lines[6], "property float probability");
  const std::size_t count = std::stoul(lines[2].substr(std::string("element vertex ").size()));
  EXPECT_EQ(bytes.size(), at + 28 * count);
  std::vector<ReadPoint> points(count);
  for (ReadPoint& point : points) {
    point.x = Take<double>(bytes, at);
    point.y = Take<double>(bytes, at);
    point.z = Take<double>(bytes, at);
    point.probability = Take<float>(bytes, at);
  }
  return points;
}

std::vector<ColumnPoint> SomePoints() {
  return {{{1.25, -2.5, 0.5}, 9}, {{-1'000.75, 3.0, 7.5}, 15}, {{0.0, 0.0, -4.5}, 12}};
}

class PointFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) / (std::string("points_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // In two pieces.
  std::string Written(const std::string& name) const {
    Result<PointFile> file = PointFile::Create(folder_ / name);
    EXPECT_TRUE(file.has_value());
    const std::vector<ColumnPoint> points = SomePoints();
    EXPECT_TRUE(file->Add(std::span(points).first(1)).ok());
    EXPECT_TRUE(file->Add({}).ok());
    EXPECT_TRUE(file->Add(std::span(points).subspan(1)).ok());
    EXPECT_EQ(file->points(), 3U);
    EXPECT_FALSE(std::filesystem::exists(folder_ / name));
    EXPECT_TRUE(file->Finish().ok());
    std::ifstream stream(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  static void ExpectSomePoints(const std::vector<ReadPoint>& read) {
    const std::vector<ColumnPoint> points = SomePoints();
    ASSERT_EQ(read.size(), points.size());
    for (std::size_t i = 0; i < read.size(); ++i) {
      EXPECT_EQ(read[i].x, points[i].p_world.x()) << i;
      EXPECT_EQ(read[i].y, points[i].p_world.y()) << i;
      EXPECT_EQ(read[i].z, points[i].p_world.z()) << i;
      EXPECT_NEAR(read[i].probability, NibbleProbability(points[i].state), 1e-6) << i;
    }
  }

  std::size_t Files() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder_),
                                                  std::filesystem::directory_iterator()));
  }

  std::filesystem::path folder_;
};

TEST_F(PointFileTest, PcdIsReadBack) {
  ExpectSomePoints(ReadPcd(Written("map.pcd")));
  EXPECT_EQ(Files(), 1U);
}

TEST_F(PointFileTest, PlyIsReadBack) {
  ExpectSomePoints(ReadPly(Written("map.PLY")));
}

TEST_F(PointFileTest, PlyKeepsMillimetresFarFromTheOrigin) {
  Result<PointFile> file = PointFile::Create(folder_ / "far.ply");
  ASSERT_TRUE(file.has_value());
  const std::vector<ColumnPoint> points{{{4'429'876.543, 5'123'456.789, 12.5}, 9}};
  ASSERT_TRUE(file->Add(points).ok());
  ASSERT_TRUE(file->Finish().ok());
  std::ifstream stream(folder_ / "far.ply", std::ios::binary);
  const auto read = ReadPly({std::istreambuf_iterator<char>(stream), {}});
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].x, 4'429'876.543);
  EXPECT_EQ(read[0].y, 5'123'456.789);
}

TEST_F(PointFileTest, PcdKeepsMillimetresAroundTheOriginThatItIsGiven) {
  const std::vector<ColumnPoint> points{{{4'429'876.543, 5'123'456.789, 12.5}, 9}};
  struct Written {
    double x;
    double rounding_m;
  };
  const auto written = [&](const Eigen::Vector3d& origin_m) -> Written {
    Result<PointFile> file = PointFile::Create(folder_ / "far.pcd", origin_m);
    EXPECT_TRUE(file && file->Add(points).ok() && file->Finish().ok());
    std::ifstream stream(folder_ / "far.pcd", std::ios::binary);
    return {ReadPcd({std::istreambuf_iterator<char>(stream), {}}).at(0).x, file->rounding_m()};
  };
  const Written near = written({4'429'000.0, 5'123'000.0, 0.0});
  EXPECT_NEAR(near.x, 876.543, near.rounding_m);
  EXPECT_LT(near.rounding_m, 1e-4);
  const Written far = written(Eigen::Vector3d::Zero());
  EXPECT_EQ(far.rounding_m, 0.25) << "half of what float32 can tell apart at 5,000 km";
  EXPECT_NEAR(far.x, 4'429'876.543, far.rounding_m);
  EXPECT_NE(far.x, 4'429'876.543);
}

TEST_F(PointFileTest, WhatIsNotFinishedIsNotThere) {
  {
    Result<PointFile> file = PointFile::Create(folder_ / "map.pcd");
    ASSERT_TRUE(file.has_value());
    EXPECT_TRUE(file->Add(SomePoints()).ok());
    EXPECT_EQ(Files(), 1U);
  }
  EXPECT_EQ(Files(), 0U);
}

TEST_F(PointFileTest, BadNamesAreTyped) {
  const auto code = [](const std::filesystem::path& path) {
    const auto file = PointFile::Create(path);
    return file ? StatusCode::kOk : file.error().code();
  };
  EXPECT_EQ(code(folder_ / "map.las"), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(folder_ / "map"), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(folder_ / "none" / "map.pcd"), StatusCode::kNotFound);
  std::filesystem::create_directory(folder_ / "folder.ply");
  EXPECT_EQ(code(folder_ / "folder.ply"), StatusCode::kConflict);
  EXPECT_EQ(Files(), 1U);
}

TEST_F(PointFileTest, AFullDiskIsSaid) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP();
  std::filesystem::create_symlink("/dev/full", folder_ / "map.pcd.partial");
  Result<PointFile> file = PointFile::Create(folder_ / "map.pcd");
  ASSERT_TRUE(file.has_value());  // buffered until there is more of it
  Status status = file->Add(SomePoints());
  if (status.ok()) status = file->Finish();
  EXPECT_EQ(status.code(), StatusCode::kResourceExhausted);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "map.pcd"));
}

}  // namespace
}  // namespace atlas
