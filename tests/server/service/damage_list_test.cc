// What the workers know of a tile that fails.
#include "server/service/fusion/damage_list.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr TileId kTile{0, 3, 4};
const Status kWhy(StatusCode::kInvalidData, "keyframe 4 is damaged");
const Status kOtherWhy(StatusCode::kInvalidData, "keyframe 5 is damaged");

TEST(DamageListTest, WhatIsNotedIsSoWithItsReasonAlone) {
  DamageList list;
  list.Add(kTile, kWhy, true);
  EXPECT_TRUE(list.IsNoted(kTile, kWhy));
  EXPECT_FALSE(list.IsNoted(kTile, kOtherWhy));
  EXPECT_FALSE(list.IsNoted({0, 4, 3}, kWhy));
  list.Add(kTile, kOtherWhy, true);
  EXPECT_FALSE(list.IsNoted(kTile, kWhy));
}

TEST(DamageListTest, WhatCouldNotBeNotedIsListed) {
  DamageList list;
  EXPECT_TRUE(list.Add(kTile, kWhy, false));
  EXPECT_TRUE(list.Contains(kTile));
  EXPECT_FALSE(list.IsNoted(kTile, kWhy));
  EXPECT_FALSE(list.Add(kTile, kWhy, true)) << "no news";
  EXPECT_TRUE(list.IsNoted(kTile, kWhy));
}

TEST(DamageListTest, WhatIsRemovedIsNewsAgain) {
  DamageList list;
  list.Add(kTile, kWhy, true);
  list.Remove(kTile);
  EXPECT_TRUE(list.WhatKeepsAll(std::array{kTile}).ok());
  EXPECT_FALSE(list.IsNoted(kTile, kWhy));
  EXPECT_TRUE(list.Add(kTile, kWhy, true));
}

// One that was written may be listed a moment longer, and another may fail for want of room.
TEST(DamageListTest, DamageKeepsAllTilesOnlyWhereEachOfThemIsListed) {
  constexpr TileId kOther{0, 4, 3};
  constexpr TileId kLate{1, 7, 7};
  DamageList list;
  list.Add(kOther, kOtherWhy, true);
  list.Add(kLate, kOtherWhy, true);
  EXPECT_TRUE(list.WhatKeepsAll({}).ok());
  EXPECT_TRUE(list.WhatKeepsAll(std::array{kTile, kOther}).ok());
  list.Add(kTile, kWhy, true);
  const Status why = list.WhatKeepsAll(std::array{kTile, kOther});
  EXPECT_EQ(why.code(), StatusCode::kInvalidData);
  EXPECT_THAT(why.message(), ::testing::HasSubstr("2 tiles cannot be fused"));
  EXPECT_THAT(why.message(), ::testing::HasSubstr("keyframe 4 is damaged"));
}

}  // namespace
}  // namespace atlas
