#include "core/geometry/tile_id.h"

#include <algorithm>
#include <cstdlib>
#include <random>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(TileIdTest, GoldenKeys) {
  EXPECT_EQ((TileId{0, TileId::kMinCoordinate, TileId::kMinCoordinate}.Key()), 0u);
  EXPECT_EQ((TileId{0, 0, 0}.Key()), 0x0300000000000000u);
  EXPECT_EQ((TileId{1, 1, -1}.Key()), 0x05AAAAAAAAAAAAABu);
}

TEST(TileIdTest, KeysReadBack) {
  std::mt19937 random(6);
  for (int i = 0; i < 10'000; ++i) {
    const auto coordinate = [&] {
      return static_cast<std::int32_t>(random() % (1u << 29)) + TileId::kMinCoordinate;
    };
    const TileId id{static_cast<std::uint8_t>(random() % 16), coordinate(), coordinate()};
    EXPECT_EQ(TileId::FromKey(id.Key()).value(), id);
  }
}

TEST(TileIdTest, RefusesKeysWithTheSignBit) {
  EXPECT_FALSE(TileId::FromKey(std::uint64_t{1} << 63).has_value());
}

TEST(TileIdTest, ChildrenKnowTheirParent) {
  for (const TileId parent : {TileId{3, 5, -7}, TileId{1, 0, 0}, TileId{2, -1, -1}}) {
    std::set<std::uint64_t> keys;
    for (const TileId& child : parent.Children()) {
      EXPECT_EQ(child.Parent(), parent);
      keys.insert(child.Key());
    }
    EXPECT_EQ(keys.size(), 4u);
    EXPECT_EQ(*keys.rbegin() - *keys.begin(), 3u);  // four children are neighbours in key order
  }
}

TEST(TileIdTest, KeyOrderKeepsAlignedSquaresTogether) {
  // All 64 tiles of an aligned 8 x 8 square have consecutive keys.
  std::set<std::uint64_t> keys;
  for (int i = 0; i < 64; ++i) {
    keys.insert(TileId{0, -16 + i % 8, 24 + i / 8}.Key());
  }
  EXPECT_EQ(*keys.rbegin() - *keys.begin(), 63u);
}

TEST(TileIdTest, PrintsAsPath) {
  std::ostringstream out;
  out << TileId{0, 12, -3};
  EXPECT_EQ(out.str(), "0/12/-3");
}

}  // namespace
}  // namespace atlas
