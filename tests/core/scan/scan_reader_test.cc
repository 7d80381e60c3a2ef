// Scans from files that may be anything.
#include "core/scan/scan_reader.h"

#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

Bytes Returns(std::span<const float> values) {
  ByteWriter out;
  for (const float value : values) {
    out.U32(std::bit_cast<std::uint32_t>(value));
  }
  return out.Take();
}

TEST(ScanReaderTest, ReadsLittleEndianFloatsAndLeavesOutTheIntensity) {
  const Bytes bytes = {0x00, 0x00, 0x80, 0x3F,   // 1
                       0x00, 0x00, 0x20, 0xC0,   // -2.5
                       0xCD, 0xCC, 0xCC, 0x3D,   // 0.1
                       0x00, 0x00, 0x80, 0x3F};  // 1: intensity
  const Result<PointCloud> cloud = ParseScan(bytes);
  ASSERT_TRUE(cloud.has_value());
  ASSERT_EQ(cloud->size(), 1U);
  EXPECT_EQ(cloud->points[0], Eigen::Vector3f(1.0F, -2.5F, 0.1F));
}

TEST(ScanReaderTest, RefusesEverySizeThatIsNotAMultipleOfAReturn) {
  for (std::size_t size = 0; size <= 80; ++size) {
    const Result<PointCloud> cloud = ParseScan(Bytes(size, 0));
    EXPECT_EQ(cloud.has_value(), size > 0 && size % 16 == 0) << size;
    if (!cloud) {
      EXPECT_EQ(cloud.error().code(), StatusCode::kInvalidData);
    }
  }
}

TEST(ScanReaderTest, RefusesAnyCoordinateThatIsNoPlace) {
  for (const float bad : {1000.1F, -1000.1F, 1e30F, std::numeric_limits<float>::max()}) {
    for (std::size_t at = 0; at < 12; ++at) {
      std::array<float, 12> values{1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0};
      values[at] = bad;
      const Result<PointCloud> cloud = ParseScan(Returns(values));
      if (at % 4 == 3) {  // intensity is not believed
        EXPECT_TRUE(cloud.has_value()) << bad;
        continue;
      }
      ASSERT_FALSE(cloud.has_value()) << bad << " at " << at;
      EXPECT_EQ(cloud.error().code(), StatusCode::kInvalidData);
      const std::string which = "return " + std::to_string(at / 4);
      EXPECT_NE(cloud.error().message().find(which), std::string::npos) << cloud.error().message();
    }
  }
}

TEST(ScanReaderTest, WhereNothingCameBackThereIsNoReturn) {
  for (const float none : {kNan, -kNan, std::numeric_limits<float>::signaling_NaN(), kInf, -kInf}) {
    for (std::size_t at = 0; at < 12; ++at) {
      std::array<float, 12> values{1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0};
      values[at] = none;
      const Result<PointCloud> cloud = ParseScan(Returns(values));
      ASSERT_TRUE(cloud.has_value()) << none << " at " << at;
      if (at % 4 == 3) {  // intensity is not believed
        EXPECT_EQ(cloud->size(), 3U);
        EXPECT_TRUE(cloud->dropped.empty());
        continue;
      }
      EXPECT_EQ(cloud->size(), 2U) << none << " at " << at;
      EXPECT_EQ(cloud->dropped, std::vector<std::uint32_t>{static_cast<std::uint32_t>(at / 4)});
      EXPECT_EQ(cloud->points[0].x(), at / 4 == 0 ? 4.0F : 1.0F);
      EXPECT_EQ(cloud->points[1].x(), at / 4 == 2 ? 4.0F : 7.0F);
    }
  }
}

TEST(ScanReaderTest, AScanWithoutAReturnIsDamaged) {
  std::array<float, 12> values{};
  values.fill(kNan);
  const Result<PointCloud> cloud = ParseScan(Returns(values));
  ASSERT_FALSE(cloud.has_value());
  EXPECT_EQ(cloud.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(cloud.error().message().find("none of its 3 entries"), std::string::npos)
      << cloud.error().message();
}

TEST(ScanReaderTest, ADroppedEntryCountsInTheNumberOfABadOne) {
  const std::array<float, 12> values{kNan, 0, 0, 0, 1, 2, 3, 0, 2000, 0, 0, 0};
  const Result<PointCloud> cloud = ParseScan(Returns(values));
  ASSERT_FALSE(cloud.has_value());
  EXPECT_NE(cloud.error().message().find("return 2"), std::string::npos) << cloud.error().message();
}

TEST(ScanReaderTest, AcceptsTheLimitsAndWhatIsAlmostNothing) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  for (const float fine : {1000.0F, -1000.0F, 0.0F, -0.0F, tiny, -tiny}) {
    const std::array<float, 4> values{fine, fine, fine, 0.0F};
    EXPECT_TRUE(ParseScan(Returns(values)).has_value()) << fine;
  }
}

TEST(ScanReaderTest, RandomBytesMakeAnErrorOrAFiniteCloud) {
  std::mt19937 random(7);
  int accepted = 0;
  for (int round = 0; round < 2000; ++round) {
    Bytes bytes(16 * (1 + random() % 3));
    for (std::uint8_t& byte : bytes) {
      byte = static_cast<std::uint8_t>(random());
    }
    for (std::size_t i = 3; i < bytes.size(); i += 4) {
      bytes[i] = random() % 8 == 0 ? 0x7F : bytes[i] & 0xBF;  // large and special ones are rare
    }
    const Result<PointCloud> cloud = ParseScan(bytes);
    if (cloud) {
      ++accepted;
      EXPECT_EQ(cloud->size() + cloud->dropped.size(), bytes.size() / 16);
      EXPECT_GT(cloud->size(), 0U);
      for (const Eigen::Vector3f& p : cloud->points) {
        EXPECT_TRUE(p.allFinite() && p.cwiseAbs().maxCoeff() <= 1000.0F);
      }
    }
  }
  EXPECT_GT(accepted, 200);
  EXPECT_LT(accepted, 1800);
}

class ScanFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("scan_file_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path Write(const std::string& name, std::size_t size) const {
    std::ofstream(folder_ / name, std::ios::binary) << std::string(size, '\0');
    return folder_ / name;
  }

  static PointCloud CloudOf(std::size_t returns) {
    PointCloud cloud;
    cloud.points.assign(returns, Eigen::Vector3f::UnitX());
    return cloud;
  }

  fs::path folder_;
};

TEST_F(ScanFileTest, WhatIsNoFileIsAnErrorWithItsName) {
  for (const fs::path& path : {folder_ / "missing.bin", folder_ / "a" / "b.bin"}) {
    const Result<PointCloud> cloud = ReadScan(path);
    ASSERT_FALSE(cloud.has_value()) << path;
    EXPECT_EQ(cloud.error().code(), StatusCode::kNotFound) << path;
    EXPECT_NE(cloud.error().message().find(path.string()), std::string::npos);
  }
}

TEST_F(ScanFileTest, AFolderIsNoScan) {
  EXPECT_EQ(ReadScan(folder_).error().code(), StatusCode::kInvalidData);
}

TEST_F(ScanFileTest, AnEmptyFileIsNoScan) {
  const Result<PointCloud> cloud = ReadScan(Write("000000.bin", 0));
  ASSERT_FALSE(cloud.has_value());
  EXPECT_EQ(cloud.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(cloud.error().message().find("000000.bin"), std::string::npos);
}

TEST_F(ScanFileTest, AHugeFileIsRefusedUnread) {
  const fs::path path = Write("000000.bin", 16);
  fs::resize_file(path, std::uintmax_t{1} << 34);  // sparse: 16 GiB of nothing
  EXPECT_EQ(ReadScan(path).error().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(ReadLabels(path, CloudOf(1)).error().code(), StatusCode::kResourceExhausted);
}

TEST_F(ScanFileTest, TheLimitItselfIsRead) {
  const fs::path path = Write("file", 100);
  EXPECT_EQ(ReadFileBytes(path, 100)->size(), 100U);
  EXPECT_EQ(ReadFileBytes(path, 99).error().code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(ReadFileBytes(Write("empty", 0), 0)->empty());
}

TEST_F(ScanFileTest, LabelsNeedExactlyFourBytesAReturn) {
  for (std::size_t size = 0; size <= 12; ++size) {
    const Result<std::vector<std::uint32_t>> labels =
        ReadLabels(Write("000000.label", size), CloudOf(2));
    EXPECT_EQ(labels.has_value(), size == 8) << size;
  }
}

TEST_F(ScanFileTest, LabelsOfDroppedEntriesAreLeftOut) {
  const fs::path path = folder_ / "000000.label";
  ByteWriter out;
  for (std::uint32_t label = 10; label < 15; ++label) out.U32(label);
  const Bytes bytes = out.Take();
  std::ofstream(path, std::ios::binary) << std::string(bytes.begin(), bytes.end());
  PointCloud cloud = CloudOf(3);
  cloud.dropped = {0, 3};
  const auto labels = ReadLabels(path, cloud);
  ASSERT_TRUE(labels.has_value());
  EXPECT_EQ(*labels, (std::vector<std::uint32_t>{11, 12, 14}));
  cloud.dropped = {0};
  EXPECT_EQ(ReadLabels(path, cloud).error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
