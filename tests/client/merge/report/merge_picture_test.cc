#include "client/merge/report/merge_picture.h"

#include <algorithm>
#include <optional>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr Rgb kWhite{255, 255, 255};
constexpr Rgb kFirst{0, 114, 178};
constexpr Rgb kSecond{213, 94, 0};
constexpr Rgb kClosure{170, 170, 170};
constexpr Rgb kTile{222, 235, 247};

// Pixels of a colour in columns [begin, end) of the maps, above the legend.
std::size_t Count(const Image& image, Rgb color, std::uint32_t begin, std::uint32_t end) {
  std::size_t count = 0;
  for (std::uint32_t y = 40; y < 740; ++y) {
    for (std::uint32_t x = begin; x < end; ++x) count += image.at(x, y) == color ? 1U : 0U;
  }
  return count;
}

// Of the topmost pixel of a colour in the left or the right map.
std::optional<std::uint32_t> TopOf(const Image& image, Rgb color, bool is_right) {
  for (std::uint32_t y = 40; y < 740; ++y) {
    for (std::uint32_t x = is_right ? 700 : 0; x < (is_right ? 1'400U : 700U); ++x) {
      if (image.at(x, y) == color) return y;
    }
  }
  return std::nullopt;
}

MergePicture TwoWays() {
  MergePicture picture;
  picture.sessions = {
      {"first", {{0.0, 0.0}, {5.0, 0.0}, {10.0, 0.0}}, {{0.0, 0.0}, {5.0, 0.0}, {10.0, 0.0}}},
      {"second", {{0.0, 10.0}, {5.0, 10.0}, {10.0, 10.0}}, {{0.0, 1.0}, {5.0, 1.0}, {10.0, 1.0}}}};
  return picture;
}

TEST(MergePictureTest, WaysAreDrawnBeforeAndAfterInOneScale) {
  const Image image = DrawMerge(TwoWays());
  ASSERT_EQ(image.width, 1'400U);
  for (const bool is_right : {false, true}) {
    ASSERT_TRUE(TopOf(image, kFirst, is_right).has_value());
    ASSERT_TRUE(TopOf(image, kSecond, is_right).has_value());
    EXPECT_LT(*TopOf(image, kSecond, is_right), *TopOf(image, kFirst, is_right)) << "north is up";
  }
  EXPECT_EQ(TopOf(image, kFirst, false), TopOf(image, kFirst, true)) << "it stayed";
  // Ten metres are 640 pixels.
  EXPECT_NEAR(*TopOf(image, kFirst, false) - *TopOf(image, kSecond, false), 640.0, 2.0);
  EXPECT_NEAR(*TopOf(image, kFirst, true) - *TopOf(image, kSecond, true), 64.0, 2.0);
}

TEST(MergePictureTest, ClosuresAreGreyWhereTheyWereAndAre) {
  MergePicture picture = TwoWays();
  EXPECT_EQ(Count(DrawMerge(picture), kClosure, 0, 1'400), 0U);
  picture.closures_before = {{{5.0, 0.0}, {5.0, 10.0}}};
  EXPECT_GT(Count(DrawMerge(picture), kClosure, 0, 700), 300U);
  EXPECT_EQ(Count(DrawMerge(picture), kClosure, 700, 1'400), 0U);
  picture.closures_after = {{{5.0, 0.0}, {5.0, 1.0}}};
  EXPECT_GT(Count(DrawMerge(picture), kClosure, 700, 1'400), 30U);
}

TEST(MergePictureTest, WhatNobodyDroveIsNoWay) {
  MergePicture picture;
  picture.sessions = {{"jump", {{0.0, 0.0}, {100.0, 0.0}}, {{0.0, 0.0}, {100.0, 0.0}}}};
  EXPECT_EQ(Count(DrawMerge(picture), kFirst, 0, 1'400), 0U);
}

TEST(MergePictureTest, EachSessionHasALineOfTheLegend) {
  MergePicture picture = TwoWays();
  const std::uint32_t height = DrawMerge(picture).height;
  picture.sessions.push_back({"a third one that drove nowhere", {}, {}});
  const Image image = DrawMerge(picture);
  EXPECT_EQ(image.height, height + 18);
}

// A way of ten metres for each, one beside the other.
MergePicture ManyWays(std::size_t count) {
  MergePicture picture;
  for (std::size_t i = 0; i < count; ++i) {
    const double y = static_cast<double>(i);
    picture.sessions.push_back(
        {"one", {{0.0, y}, {5.0, y}, {10.0, y}}, {{0.0, y}, {5.0, y}, {10.0, y}}});
  }
  return picture;
}

// Pixels of a way in the left map, in its row.
std::size_t CountWay(const Image& image, std::size_t i, std::size_t count) {
  const double px_a_m = 640.0 / std::max(10.0, static_cast<double>(count - 1));
  const double middle = 0.5 * static_cast<double>(count - 1);
  const auto y =
      static_cast<std::uint32_t>(390.0 - px_a_m * (static_cast<double>(i) - middle) - 0.5);
  std::size_t drawn = 0;
  for (std::uint32_t x = 0; x < 700; ++x) drawn += image.at(x, y) == kWhite ? 0U : 1U;
  return drawn;
}

TEST(MergePictureTest, NoTwoOfTwentyOneSessionsLookAlike) {
  const Image image = DrawMerge(ManyWays(21));
  // The first, eighth and fifteenth have one colour: solid, and with ever more gaps.
  EXPECT_GT(CountWay(image, 0, 21), CountWay(image, 7, 21) + 50);
  EXPECT_GT(CountWay(image, 7, 21), CountWay(image, 14, 21) + 30);
  EXPECT_GT(CountWay(image, 14, 21), 50U);
}

TEST(MergePictureTest, TilesAreMarkedWhereTheMapChanges) {
  MergePicture picture = TwoWays();
  const std::uint32_t height = DrawMerge(picture).height;
  picture.tiles = {{Eigen::Vector2d(2.0, 4.0), Eigen::Vector2d(6.0, 8.0)}};
  const Image image = DrawMerge(picture);
  EXPECT_EQ(Count(image, kTile, 0, 700), 0U) << "before";
  EXPECT_NEAR(static_cast<double>(Count(image, kTile, 700, 1'400)), 256.0 * 256.0, 1'000.0);
  EXPECT_EQ(image.height, height + 18) << "it is in the legend";
  picture.tiles.emplace_back(Eigen::Vector2d(30.0, 0.0), Eigen::Vector2d(34.0, 4.0));
  EXPECT_EQ(Count(DrawMerge(picture), kTile, 0, 700), 0U) << "one far away is within its map";
}

TEST(MergePictureTest, ClosuresOfSessionsFarApartLeaveTheWaysToBeSeen) {
  MergePicture picture = TwoWays();
  for (int i = 0; i < 1'000; ++i) {
    picture.closures_before.push_back({{0.01 * i, 0.0}, {0.01 * i, 10.0}});
    picture.closures_after.push_back({{0.01 * i, 0.0}, {0.01 * i, 0.5}});
  }
  const Image image = DrawMerge(picture);
  EXPECT_LT(Count(image, kClosure, 0, 700), 60U * 640U);
  EXPECT_GT(Count(image, kClosure, 0, 700), 50U * 630U);
  EXPECT_GT(Count(image, kClosure, 700, 1'400), 600U * 25U) << "short ones are all there";
}

TEST(MergePictureTest, WithoutAPointItIsEmpty) {
  const Image image = DrawMerge({});
  ASSERT_EQ(image.width, 1'400U);
  EXPECT_EQ(Count(image, kWhite, 0, 1'400), 1'400U * 700U);
  MergePicture picture;
  picture.sessions = {{"one", {{3.0, 3.0}}, {{3.0, 3.0}}}};
  EXPECT_EQ(Count(DrawMerge(picture), kFirst, 0, 1'400), 0U) << "a point is no way";
}

}  // namespace
}  // namespace atlas
