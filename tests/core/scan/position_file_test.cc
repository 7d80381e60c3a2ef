#include "core/scan/position_file.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

namespace atlas {
namespace {

namespace fs = std::filesystem;

class PositionFileTest : public ::testing::Test {
 protected:
  PositionFileTest() {
    for (const std::uint32_t number : {0U, 2U, 3U, 17U}) {
      drive_.scans.push_back({number, {}, std::nullopt, Pose::Identity(), std::nullopt});
    }
  }
  ~PositionFileTest() override { fs::remove(path_); }

  Result<KnownPlaces> Read(const std::string& text) const {
    std::ofstream(path_, std::ios::binary) << text;
    return ReadPositions(path_, drive_);
  }
  void ExpectRefused(const std::string& text, const std::string& says) const {
    const auto places = Read(text);
    ASSERT_FALSE(places) << text;
    EXPECT_EQ(places.error().code(), StatusCode::kInvalidData) << text;
    EXPECT_NE(places.error().message().find(path_.string() + ": " + says), std::string::npos)
        << places.error().message();
  }

  const fs::path path_ =
      fs::path(::testing::TempDir()) / ("positions." + std::to_string(getpid()) + ".txt");
  DriveFolder drive_;
};

TEST_F(PositionFileTest, HasAPlaceForEachLineInAnyOrder) {
  const auto places = Read("# a receiver's\n17 1 -2.5 3e2 0.5\r\n\n  2\t4 5 6 100000\n");
  ASSERT_TRUE(places) << places.error().message();
  EXPECT_EQ(*places, (KnownPlaces{{2, {Eigen::Vector3d(4.0, 5.0, 6.0), 1e5}},
                                  {17, {Eigen::Vector3d(1.0, -2.5, 300.0), 0.5}}}));
}

TEST_F(PositionFileTest, WhatIsWrittenReadsBack) {
  const KnownPlaces places{{0, {Eigen::Vector3d(-1234567.1234, 0.0002, -9.0), 0.001}},
                           {3, {Eigen::Vector3d(1e7, -1e7, 0.0), 2.5}}};
  const auto read = Read(PositionFileText(places));
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->size(), 2U);
  for (const auto& [scan, place] : places) {
    EXPECT_LT((read->at(scan).p_world - place.p_world).norm(), 1e-4);
    EXPECT_EQ(read->at(scan).radius_m, place.radius_m);
  }
}

TEST_F(PositionFileTest, ALineOfAnotherFormIsNamed) {
  const std::string good = "0 1 2 3 0.5\n";
  for (const std::string bad :
       {"2 1 2 3", "2 1 2 3 0.5 6", "2 1 2 three 0.5", "2,1,2,3,0.5", "2 1 2 3-1 0.5", "zwei"}) {
    ExpectRefused(good + bad + "\n", "line 2: expected five numbers");
  }
  ExpectRefused("\n# nothing\n" + good + "\n\n2\n", "line 6: ");
}

TEST_F(PositionFileTest, AScanThatIsNotThereOrTwiceIsNamed) {
  const std::string good = "0 1 2 3 0.5\n";
  for (const std::string number : {"1", "-1", "2.5", "18", "4294967298", "nan", "inf", "1e300"}) {
    ExpectRefused(good + number + " 1 2 3 0.5\n", "line 2: the drive has no scan ");
  }
  ExpectRefused(good + "3 1 2 3 0.5\n" + good, "line 3: scan 0 has a position already");
  // So it is when there are more lines than scans.
  ExpectRefused("0 1 2 3 1\n2 1 2 3 1\n3 1 2 3 1\n17 1 2 3 1\n18 1 2 3 1\n",
                "line 5: the drive has no scan 18");
}

TEST_F(PositionFileTest, APlaceThatIsNoneIsNamed) {
  for (const std::string place : {"nan 2 3", "1 inf 3", "1 2 -inf", "1.1e7 0 0", "0 0 -1e8"}) {
    ExpectRefused("2 " + place + " 0.5\n", "line 1: position ");
  }
  for (const std::string radius : {"0", "-0.5", "nan", "inf", "0.0009", "100001"}) {
    ExpectRefused("2 1 2 3 " + radius + "\n", "line 1: radius ");
  }
}

TEST_F(PositionFileTest, NothingInItIsAMistake) {
  ExpectRefused("", "no position in it");
  ExpectRefused("# scan x y z radius\n\n", "no position in it");
  const auto missing = ReadPositions(path_ / "nowhere", drive_);
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
