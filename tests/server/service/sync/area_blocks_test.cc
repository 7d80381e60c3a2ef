#include "server/service/sync/area_blocks.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "server/store/tile_block.h"

namespace atlas {
namespace {

SyncArea Make(MapArea shape) {
  return SyncArea::Create(std::move(shape), MapProfile()).value();  // tiles of 12.8 m
}

std::vector<std::uint64_t> OneByOne(const SyncArea& area, const BlockRect& rect) {
  std::vector<std::uint64_t> blocks;
  for (std::int64_t y = rect.min_y; y < rect.min_y + rect.height; ++y) {
    for (std::int64_t x = rect.min_x; x < rect.min_x + rect.width; ++x) {
      const TileId corner{rect.level, static_cast<std::int32_t>(x * kTileBlockSide),
                          static_cast<std::int32_t>(y * kTileBlockSide)};
      if (area.Touches(corner, kTileBlockSideBits)) {
        blocks.push_back(TileBlockOf(corner.Key()));
      }
    }
  }
  std::sort(blocks.begin(), blocks.end());
  return blocks;
}

// From side to side of a square.
CorridorArea Zigzag(int points, double side_m) {
  CorridorArea corridor{{}, 0.0};
  for (int i = 0; i < points; ++i) {
    corridor.route_m.emplace_back(i % 2 * side_m, i * side_m / (points - 1));
  }
  return corridor;
}

TEST(AreaBlocksTest, AllBlocksThatAreTouchedAreFound) {
  std::mt19937 random(1);
  // Often on the edges of blocks.
  const auto place_m = [&] {
    return random() % 2 == 0 ? 102.4 * static_cast<double>(random() % 40) - 2'048.0
                             : static_cast<double>(random() % 40'960) / 10.0 - 2'048.0;
  };
  for (int i = 0; i < 300; ++i) {
    const double reach_m = i % 5 * 51.2;
    CorridorArea corridor{{}, reach_m};
    for (int n = 0; n < 1 + i % 7; ++n) {
      corridor.route_m.emplace_back(place_m(), place_m());
    }
    const Eigen::Vector2d lower = corridor.route_m[0];
    const Eigen::Vector2d upper = lower + Eigen::Vector2d(reach_m, 300.0);
    const SyncArea area = i % 3 == 0   ? Make(BoxArea{lower, upper})
                          : i % 3 == 1 ? Make(DiscArea{lower, reach_m})
                                       : Make(corridor);
    const BlockRect rect = BlocksAround(area, static_cast<std::uint8_t>(i % 4));
    PlanWork work;
    const auto found = FindBlocks(area, rect, work);
    ASSERT_TRUE(found.has_value());
    EXPECT_FALSE(found->empty());
    EXPECT_EQ(*found, OneByOne(area, rect)) << i;
  }
}

TEST(AreaBlocksTest, ALegIsComparedWithTheBlocksBesideIt) {
  const SyncArea area = Make(Zigzag(256, 25'000.0));
  const BlockRect rect = BlocksAround(area, 1);
  ASSERT_GT(rect.count(), 15'000);
  PlanWork work;
  const auto found = FindBlocks(area, rect, work);
  ASSERT_TRUE(found.has_value());
  // Each leg crosses one row of blocks, or two of them.
  const std::size_t compared = work.done() - found->size() * WorkOfBlock(area);
  EXPECT_LT(compared, 255u * 2 * (static_cast<std::size_t>(rect.width) + 4));
}

TEST(AreaBlocksTest, TheWorkIsTakenBeforeItIsDone) {
  const SyncArea area = Make(Zigzag(256, 25'000.0));
  const BlockRect rect = BlocksAround(area, 1);
  PlanWork work(16'384);
  EXPECT_FALSE(FindBlocks(area, rect, work).has_value());
  EXPECT_LE(work.done(), 16'384u);
  PlanWork none(0);
  EXPECT_FALSE(FindBlocks(area, rect, none).has_value());
  EXPECT_EQ(none.done(), 0u);
}

// What a vehicle asks for all the time.
TEST(AreaBlocksTest, ADiscTakesLittleMoreThanItsBlocks) {
  const SyncArea area = Make(DiscArea{{10.0, 10.0}, 500.0});
  PlanWork work(16'384);
  const auto found = FindBlocks(area, BlocksAround(area, 0), work);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(work.done(), found->size() * (WorkOfBlock(area) + 3));
}

}  // namespace
}  // namespace atlas
