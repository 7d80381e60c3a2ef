// What a part of an area says of its tiles is what the whole area says.
#include "server/service/sync/local_area.h"

#include <random>

#include <gtest/gtest.h>

#include "server/store/tile_block.h"
#include "tests/server/service/sync/known_tiles.h"

namespace atlas {
namespace {

// Long ways that cross themselves, narrow and wide, and the other shapes.
SyncArea AnyArea(std::mt19937& random, int i) {
  const auto place_m = [&] {
    return static_cast<double>(random() % 20'000) / 10.0 - 1'000.0;
  };
  if (i % 4 == 0) {
    return Area(AnyShape(static_cast<std::uint32_t>(i)));
  }
  CorridorArea corridor{{}, i % 3 * 150.0};
  for (int n = 0; n < 1 + i % 60; ++n) {
    corridor.route_m.emplace_back(place_m(), place_m());
  }
  return Area(corridor);
}

class LocalAreaTest : public ::testing::Test {
 protected:
  TileId AnyTile(std::uint8_t level) {
    const int side = 160 >> level;
    const auto coordinate = [&] {
      return static_cast<std::int32_t>(random_() % static_cast<unsigned>(side)) - side / 2;
    };
    return {level, coordinate(), coordinate()};
  }
  static LocalArea Around(const SyncArea& area, const TileId& id) {
    const auto corner = TileId::FromKey(FirstKeyOf(TileBlockOf(id.Key()))).value();
    return {area, corner, kTileBlockSideBits};
  }

  std::mt19937 random_{3};
};

TEST_F(LocalAreaTest, SaysWhatTheAreaSays) {
  int touched = 0;
  for (int i = 0; i < 400; ++i) {
    const SyncArea area = AnyArea(random_, i);
    const TileId id = AnyTile(static_cast<std::uint8_t>(i % 3));
    const LocalArea local = Around(area, id);
    EXPECT_EQ(local.Touches(id), area.Touches(id)) << i;
    EXPECT_EQ(local.Distance(id), area.Distance(id)) << i;
    EXPECT_EQ(local.Distance(id.Parent()), area.Distance(id.Parent())) << i;
    touched += area.Touches(id) ? 1 : 0;
  }
  EXPECT_GT(touched, 50);
  EXPECT_LT(touched, 350);
}

TEST_F(LocalAreaTest, NoTileIsNearerOrFartherOffThanItsBounds) {
  for (int i = 0; i < 400; ++i) {
    const SyncArea area = AnyArea(random_, i);
    TileId id = AnyTile(0);
    const LocalArea local = Around(area, id);
    EXPECT_GE(area.Distance(id), local.least_m()) << i;
    for (; id.level + 1 < SmallProfile().levels; id = id.Parent()) {
      EXPECT_LE(area.Distance(id), local.most_m()) << i;
    }
  }
}

TEST_F(LocalAreaTest, SaysNothingOfAVehicleWhereTheAreaDoesNot) {
  const TileId id{0, 1, 2};
  const SyncArea area = SyncArea::OfTiles({id.Key()}, SmallProfile()).value();
  const LocalArea local = Around(area, id);
  EXPECT_TRUE(local.Touches(id));
  EXPECT_FALSE(local.Touches({0, 2, 2}));
  EXPECT_EQ(local.Distance(id), 0.0);
  EXPECT_EQ(local.most_m(), 0.0);
}

}  // namespace
}  // namespace atlas
