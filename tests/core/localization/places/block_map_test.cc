// Blocks of structure against the columns that they are made of.
#include "core/localization/places/block_map.h"

#include <cmath>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::ColumnLayer;
using testing::PaintedMap;

TEST(BlockMapTest, StructureIsInTheBlockThatHoldsItAndNearThoseAroundIt) {
  std::mt19937 random(11);
  PaintedMap map;
  std::set<std::tuple<std::int64_t, std::int64_t, std::int64_t>> blocks;  // 0.4 m, 1 m
  for (int i = 0; i < 300; ++i) {
    const auto x = static_cast<std::int64_t>(random() % 600) - 300;
    const auto y = static_cast<std::int64_t>(random() % 600) - 300;
    const auto z = static_cast<std::int64_t>(random() % 30) - 15;
    map.Put(x, y, ColumnLayer(static_cast<double>(z), 0b1));
    blocks.emplace(std::floor(static_cast<double>(x) / 4.0),
                   std::floor(static_cast<double>(y) / 4.0), z);
  }
  BlockMap built(map.profile(), 0.4, 10);
  for (const auto& tile : map.Tiles()) built.Add(*tile);
  EXPECT_DOUBLE_EQ(built.block_m(), 0.4);
  BlockMap::Reader reader(built);
  std::size_t found = 0;
  for (std::int64_t y = -80; y < 80; ++y) {
    for (std::int64_t x = -80; x < 80; ++x) {
      const double x_m = 0.4 * static_cast<double>(x) + 0.2;
      const double y_m = 0.4 * static_cast<double>(y) + 0.2;
      const std::uint64_t at = reader.SegmentsAt(x_m, y_m, -20);
      const std::uint64_t near = reader.SegmentsNear(x_m, y_m, -20);
      for (std::int64_t z = -16; z < 16; ++z) {
        const bool is_at = blocks.contains({x, y, z});
        bool is_near = false;
        for (std::int64_t j = -1; j <= 1; ++j) {
          for (std::int64_t i = -1; i <= 1; ++i) {
            is_near = is_near || blocks.contains({x + i, y + j, z});
          }
        }
        ASSERT_EQ((at >> (z + 20) & 1) != 0, is_at) << x << ' ' << y << ' ' << z;
        ASSERT_EQ((near >> (z + 20) & 1) != 0, is_near) << x << ' ' << y << ' ' << z;
        found += is_at ? 1U : 0U;
      }
    }
  }
  EXPECT_EQ(found, blocks.size());
}

TEST(BlockMapTest, ParentsAreNoPartOfIt) {
  PaintedMap map;
  map.Put(0, 0, ColumnLayer(0.0, 0b1));
  BlockMap built(map.profile(), 0.4, 10);
  Tile tile = *map.Tiles().front();
  tile.id.level = 1;
  built.Add(tile);
  EXPECT_EQ(built.memory_bytes(), 0U);
  EXPECT_EQ(BlockMap::Reader(built).SegmentsAt(0.05, 0.05, 0), 0U);
}

}  // namespace
}  // namespace atlas
