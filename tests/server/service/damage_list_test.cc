// What the workers know of a tile that fails.
#include "server/service/fusion/damage_list.h"

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
  EXPECT_TRUE(list.Summary().ok());
  EXPECT_FALSE(list.IsNoted(kTile, kWhy));
  EXPECT_TRUE(list.Add(kTile, kWhy, true));
}

}  // namespace
}  // namespace atlas
