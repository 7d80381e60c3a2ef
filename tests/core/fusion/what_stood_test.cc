// What stood on a place is gone with its foot (docs/decisions/0307): tiny worlds of one cell.
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/fusion/deck_world.h"

namespace atlas {
namespace {

using testing::Deck;
using testing::Middle;
using testing::See;

// A session that sees the deck so many times, from this sequence number on: 100 ms each.
void Visit(const char* session,
           std::uint32_t begin,
           const Deck& deck,
           std::vector<PlacedKeyframe>& world,
           std::uint32_t keyframes = 20) {
  for (std::uint32_t i = 0; i < keyframes; ++i) {
    world.push_back(See(deck, {"car", session, begin + i}));
  }
}

constexpr Deck kEmpty{.occupancy = Occupancy::kFree};

// The column at the middle after somebody saw `first`, and later somebody `second`.
std::uint64_t ColumnAfter(const Deck& first, const Deck& second) {
  std::vector<PlacedKeyframe> world;
  Visit("a", 0, first, world);
  Visit("b", 100, second, world);
  return Middle(world)[0].column;
}

Deck Obstacle(std::uint64_t column) {
  return {.occupancy = Occupancy::kObstacle, .column = column};
}

TEST(WhatStoodTest, ItIsGoneWithItsFoot) {
  EXPECT_EQ(ColumnAfter(Obstacle(0xCC), kEmpty), 0x88U);  // nothing is known of the space
  EXPECT_EQ(ColumnAfter(Obstacle(0xC), kEmpty), 0x8U);
  EXPECT_EQ(ColumnAfter(Obstacle(0xCCCC), kEmpty), 0x8888U);
}

TEST(WhatStoodTest, ItsLowestSegmentMayBeFree) {
  EXPECT_EQ(ColumnAfter(Obstacle(0xC6), kEmpty) & 0xF0, 0x80U);
  EXPECT_EQ(ColumnAfter(Obstacle(0xC0), kEmpty), 0x80U);
  // Seen through below by the same visit that found the ground.
  EXPECT_EQ(ColumnAfter(Obstacle(0xCC), {.column = 0x6}) & 0xF0, 0x80U);
}

TEST(WhatStoodTest, WhatHangsStays) {
  EXPECT_EQ(ColumnAfter(Obstacle(0xC00), kEmpty), 0xF00U);
  EXPECT_EQ(ColumnAfter(Obstacle(0xC0CC), kEmpty), 0xF088U);
  EXPECT_EQ(ColumnAfter(Obstacle(0xC6CC), kEmpty) & 0xF0FF, 0xF088U);
}

TEST(WhatStoodTest, WhatIsStillSeenStays) {
  EXPECT_EQ(ColumnAfter(Obstacle(0xCC), {.column = 0xC0}), 0xFFU);
  EXPECT_EQ(ColumnAfter(Obstacle(0xCCC), {.column = 0xC00}), 0xFFFU);
  EXPECT_EQ(ColumnAfter(Obstacle(0xCC), Obstacle(0)), 0xFFU);
}

TEST(WhatStoodTest, WhatStoodOnNoObstacleStays) {
  // A branch above a free road, seen once.
  EXPECT_EQ(ColumnAfter({.column = 0xCC}, kEmpty), 0xFFU);
}

TEST(WhatStoodTest, OnlyMeasuredGroundTells) {
  const Deck guess{.occupancy = Occupancy::kFree, .source = AltitudeSource::kExtrapolated};
  EXPECT_EQ(ColumnAfter(Obstacle(0xCC), guess), 0xFFU);
}

TEST(WhatStoodTest, AGuessThatCameFirstChangesNothing) {
  const Deck guess{.occupancy = Occupancy::kFree, .source = AltitudeSource::kExtrapolated};
  std::vector<PlacedKeyframe> world;
  Visit("a", 0, Obstacle(0xCC), world);
  Visit("b", 100, guess, world);
  ASSERT_TRUE(Middle(world)[0].is_traversable());
  Visit("c", 200, kEmpty, world);
  EXPECT_EQ(Middle(world)[0].column, 0x88U);
}

TEST(WhatStoodTest, VisitsThatComeToNothingChangeNothing) {
  for (std::uint32_t misses = 1; misses <= 6; ++misses) {
    std::vector<PlacedKeyframe> world;
    Visit("a", 0, Obstacle(0xCC), world);
    Visit("b", 100, kEmpty, world, misses);
    Visit("c", 200, kEmpty, world);
    EXPECT_EQ(Middle(world)[0].column, 0x88U) << misses;
    EXPECT_TRUE(Middle(world)[0].is_traversable()) << misses;
  }
}

TEST(WhatStoodTest, ItIsAskedOnceOnly) {
  std::vector<PlacedKeyframe> world;
  Visit("a", 0, Obstacle(0xCC), world);
  Visit("b", 100, {.column = 0xC0}, world);
  Visit("c", 200, kEmpty, world);
  EXPECT_EQ(Middle(world)[0].column, 0xFFU);
}

TEST(WhatStoodTest, ItIsBackWhenItComesBack) {
  std::vector<PlacedKeyframe> world;
  Visit("a", 0, Obstacle(0xCC), world);
  Visit("b", 100, kEmpty, world);
  Visit("c", 200, Obstacle(0xCC), world);
  EXPECT_EQ(Middle(world)[0].column, 0xFFU);
  EXPECT_FALSE(Middle(world)[0].is_traversable());
}

TEST(WhatStoodTest, TheDeckAboveIsAnotherMatter) {
  std::vector<PlacedKeyframe> world;
  Visit("a", 0, Obstacle(0xCCC), world);
  Visit("b", 50, {.z_m = 3.2, .occupancy = Occupancy::kObstacle, .column = 0xCC}, world);
  // Its ceiling, in a segment that reaches into the slab, keeps nothing that stood below.
  Visit("c", 100, {.column = 0xC00}, world);
  const auto layers = Middle(world);
  ASSERT_EQ(layers.size(), 2U);
  EXPECT_EQ(layers[0].column, 0x88U);
  EXPECT_TRUE(layers[0].is_traversable());
  EXPECT_FALSE(layers[1].is_traversable());
  EXPECT_GT(layers[1].column & 0xF0, 0x80U);
}

TEST(WhatStoodTest, PresetPaperDoesAsThePaperDoes) {
  std::vector<PlacedKeyframe> world;
  Visit("a", 0, Obstacle(0xCC), world);
  Visit("b", 100, kEmpty, world);
  MapProfile profile = testing::SmallProfile();
  profile.preset = FusionPreset::kPaper;
  const Tile tile = FuseTile({0, 0, 0}, world, profile);
  EXPECT_EQ(tile.Layers(8 * 16 + 8)[0].column, 0xFFU);
}

}  // namespace
}  // namespace atlas
