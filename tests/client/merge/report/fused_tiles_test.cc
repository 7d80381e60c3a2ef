#include "client/merge/report/fused_tiles.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(FusedTilesTest, WhatLiesAboveAFusedTileIsFusedOnce) {
  const auto tiles = FusedTiles({{0, -1, 0}, {0, 0, 0}, {0, 1, 1}, {0, 2, 0}}, 3);
  ASSERT_EQ(tiles.size(), 3U);
  EXPECT_EQ(tiles[0].size(), 4U);
  EXPECT_EQ(tiles[1], (std::set<TileId>{{1, -1, 0}, {1, 0, 0}, {1, 1, 0}}));
  EXPECT_EQ(tiles[2], (std::set<TileId>{{2, -1, 0}, {2, 0, 0}}));
}

TEST(FusedTilesTest, OfNoTileNoneIsFused) {
  for (const auto& level : FusedTiles({}, 8)) EXPECT_TRUE(level.empty());
}

}  // namespace
}  // namespace atlas
