// What is remembered of an area is what the area says, and it is asked once a block.
#include "server/service/sync/touched_tiles.h"

#include <random>

#include <gtest/gtest.h>

#include "tests/server/service/sync/known_tiles.h"

namespace atlas {
namespace {

TileId AnyTile(std::mt19937& random, std::uint8_t level) {
  const int side = 32 >> level;
  const auto coordinate = [&] {
    return static_cast<std::int32_t>(random() % static_cast<unsigned>(side)) - side / 2;
  };
  return {level, coordinate(), coordinate()};
}

TEST(TouchedTilesTest, SaysWhatTheAreaSays) {
  std::mt19937 random(5);
  int touched = 0;
  int asked = 0;
  for (std::uint32_t i = 0; i < 60; ++i) {
    SyncArea area = Area(AnyShape(i));
    if (i % 4 == 0) {
      area =
          SyncArea::OfTiles({TileId{0, -3, 4}.Key(), TileId{0, 0, 0}.Key(), TileId{1, 2, 2}.Key()},
                            SmallProfile())
              .value();
    }
    TouchedTiles tiles(area, 0, 2);
    for (int n = 0; n < 500; ++n) {
      const TileId id = AnyTile(random, static_cast<std::uint8_t>(n % 3));
      ASSERT_EQ(tiles.Has(id), area.Touches(id)) << "area " << i << ", tile " << id;
      touched += area.Touches(id) ? 1 : 0;
      ++asked;
    }
  }
  EXPECT_GT(touched, asked / 10);
  EXPECT_LT(touched, asked * 9 / 10);
}

TEST(TouchedTilesTest, HasNoneOfOtherLevels) {
  TouchedTiles tiles(Area(DiscArea{{0, 0}, 1e6}), 1, 2);
  EXPECT_FALSE(tiles.Has({0, 0, 0}));
  EXPECT_TRUE(tiles.Has({1, 0, 0}));
  EXPECT_TRUE(tiles.Has({2, 0, 0}));
  EXPECT_FALSE(tiles.Has({3, 0, 0}));
}

TEST(TouchedTilesTest, AsksTheAreaOnceABlock) {
  TouchedTiles tiles(Area(DiscArea{{0, 0}, 1e4}), 0, 2);
  for (int turn = 0; turn < 3; ++turn) {
    for (std::int32_t x = 0; x < 16; ++x) {
      EXPECT_TRUE(tiles.Has({0, x, 0}));
    }
  }
  EXPECT_EQ(tiles.compared_blocks(), 2u);
}

TEST(TouchedTilesTest, AsksNothingOfWhatIsOutsideItsBounds) {
  TouchedTiles tiles(Area(CorridorArea{{{0, 0}, {300, 0}}, 10.0}), 0, 2);
  EXPECT_FALSE(tiles.Has({0, 0, 1'000}));
  EXPECT_FALSE(tiles.Has({0, -1'000, 0}));
  EXPECT_EQ(tiles.compared_blocks(), 0u);
}

// However many tiles change: bounded, and never wrong.
TEST(TouchedTilesTest, ForgetsBeforeItIsLarge) {
  TouchedTiles tiles(Area(DiscArea{{0, 0}, 1e6}), 0, 2);
  const auto count = static_cast<std::int32_t>(TouchedTiles::kMaxBlocks) + 1;
  for (std::int32_t block = 0; block < count; ++block) {
    EXPECT_TRUE(tiles.Has({0, 8 * block, 0}));
  }
  EXPECT_TRUE(tiles.Has({0, 0, 0})) << "which was forgotten";
  EXPECT_EQ(tiles.compared_blocks(), TouchedTiles::kMaxBlocks + 2);
}

}  // namespace
}  // namespace atlas
