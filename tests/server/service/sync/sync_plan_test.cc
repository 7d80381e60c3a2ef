#include "server/service/sync/sync_plan.h"

#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/service/sync/known_tiles.h"

namespace atlas {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<HeldTile> AllOf(const KnownTiles& tiles) {
  std::vector<HeldTile> held;
  for (const auto& [key, tile] : tiles.tiles()) {
    held.push_back({key, tile.payload_hash});
  }
  return held;
}

std::vector<HeldBlock> BlocksOf(const KnownTiles& tiles) {
  std::map<std::uint64_t, std::pair<HeldBlock, HeldDigest>> blocks;
  for (const auto& [key, tile] : tiles.tiles()) {
    auto& [held, digest] = blocks[TileBlockOf(key)];
    held.block = TileBlockOf(key);
    held.tiles |= std::uint64_t{1} << (key - FirstKeyOf(held.block));
    digest.Add(key, tile.payload_hash);
    held.digest = digest.value();
  }
  std::vector<HeldBlock> result;
  for (const auto& [number, block] : blocks) {
    result.push_back(block.first);
  }
  return result;
}

// Half of the tiles by themselves or in blocks, some of them changed, and others that are not
// there.
HeldTiles SomeOf(const KnownTiles& tiles, std::uint32_t seed) {
  std::vector<HeldTile> held;
  for (const HeldTile& tile : AllOf(tiles)) {
    if (TileBlockOf(tile.key) % 4 == 0) {
      held.push_back({tile.key, tile.payload_hash + (tile.key % 5 == seed % 5 ? 1 : 0)});
    }
  }
  std::vector<HeldBlock> blocks;
  for (HeldBlock block : BlocksOf(tiles)) {
    if (block.block % 4 == 1) {
      block.digest += block.block % 3 == seed % 3 ? 1 : 0;
      blocks.push_back(block);
    }
  }
  for (std::int32_t i = 0; i < 20; ++i) {
    held.push_back({TileId{0, 1'000 + 8 * i, 0}.Key(), 1});
    blocks.push_back({TileBlockOf(TileId{0, 1'000 + 8 * i, 80}.Key()), 1, 1});
  }
  return HeldTiles::Create(std::move(held), std::move(blocks)).value();
}

TEST(SyncPlanTest, WhatIsDroppedTakesNoMemory) {
  Streets tiles(1);
  SyncRequest request = Ask(DiscArea{{0.0, 0.0}, 1e6});
  request.held = SomeOf(tiles, 1);
  SyncPlan plan = Plan(request, tiles);
  ASSERT_FALSE(plan.removed.empty() || plan.differing.empty());
  plan.DropHoldings();
  for (const std::size_t capacity :
       {plan.current_tiles.capacity(), plan.current_blocks.capacity(), plan.removed.capacity(),
        plan.differing.capacity(), plan.is_tile_seen.capacity(), plan.is_block_seen.capacity()}) {
    EXPECT_EQ(capacity, 0u);
  }
}

TEST(SyncPlanTest, GoesOnAlikeWithoutWhatIsHeldOfNothing) {
  for (std::uint32_t seed = 0; seed < 30; ++seed) {
    Streets tiles(seed);
    SyncRequest request = Ask(AnyShape(seed));
    request.held = SomeOf(tiles, seed);
    const std::vector<std::uint64_t> whole = KeysOf(Plan(request, tiles).items);
    std::vector<std::uint64_t> pieces;
    for (bool is_cut = true; is_cut;) {
      const SyncPlan plan = Plan(request, tiles, {7});
      EXPECT_LE(plan.items.capacity(), 7u);
      is_cut = plan.is_cut;
      for (const SyncItem& item : plan.items) {
        pieces.push_back(item.tile.id.Key());
        request.after = SyncCursor{tiles.revision(), item.priority, item.tile.id.Key()};
      }
      request.held.KeepOnly(plan.is_tile_seen, plan.is_block_seen);
      for (const HeldTile& tile : request.held.tiles()) {
        EXPECT_TRUE(tiles.tiles().contains(tile.key));
      }
    }
    EXPECT_EQ(pieces, whole) << seed;
  }
}

TEST(SyncPlanTest, EverythingOfTheAreaOnceParentsFirst) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    Streets tiles(seed);
    const SyncRequest request = Ask(AnyShape(seed));
    const SyncPlan plan = Plan(request, tiles);
    const std::vector<std::uint64_t> keys = KeysOf(plan.items);
    EXPECT_EQ(std::set<std::uint64_t>(keys.begin(), keys.end()), Touched(request.area, tiles));
    EXPECT_FALSE(plan.is_cut);
    std::set<std::uint64_t> sent;
    bool is_cover = true;
    for (const SyncItem& item : plan.items) {
      const TileId id = item.tile.id;
      EXPECT_TRUE(id.level == 4 || sent.contains(id.Parent().Key())) << seed << ": " << id;
      EXPECT_TRUE(sent.insert(id.Key()).second) << seed << ": " << id;
      is_cover = is_cover && id.level == 4;
      EXPECT_TRUE(is_cover || id.level < 4) << seed << ": " << id;
    }
  }
}

TEST(SyncPlanTest, WhatIsHeldIsNotSent) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    Streets tiles(seed);
    SyncRequest request = Ask(AnyShape(seed));
    const auto touched = Touched(request.area, tiles);
    request.held = Hold(AllOf(tiles));
    SyncPlan plan = Plan(request, tiles);
    EXPECT_THAT(plan.items, IsEmpty());
    EXPECT_EQ(plan.not_modified, touched.size());
    const auto& held = request.held.tiles();
    for (std::size_t i = 0; i < held.size(); ++i) {
      const bool is_current = (plan.current_tiles[i / 8] >> i % 8 & 1) != 0;
      EXPECT_EQ(is_current, touched.contains(held[i].key));
    }
    request.held = Hold({}, BlocksOf(tiles));
    plan = Plan(request, tiles);
    EXPECT_THAT(plan.items, IsEmpty());
    EXPECT_THAT(plan.differing, IsEmpty());
    EXPECT_EQ(plan.not_modified, touched.size());
  }
}

TEST(SyncPlanTest, ExactlyWhatChangedIsSent) {
  Streets tiles(3);
  SyncRequest request = Ask(DiscArea{{0, 0}, 1'000.0});
  request.held = Hold(AllOf(tiles));
  const TileId changed = tiles.tiles().begin()->second.id;
  const TileId gone = std::next(tiles.tiles().begin(), 5)->second.id;
  const std::uint64_t old_hash = tiles.tiles().begin()->second.payload_hash;
  tiles.Put(changed, 99);
  tiles.Remove(gone);
  const SyncPlan plan = Plan(request, tiles);
  ASSERT_EQ(plan.items.size(), 1u);
  EXPECT_EQ(plan.items[0].tile.id, changed);
  EXPECT_EQ(plan.items[0].held_hash, old_hash);
  EXPECT_THAT(plan.removed, ElementsAre(gone.Key()));
  EXPECT_EQ(plan.not_modified, request.held.tiles().size() - 2);
}

TEST(SyncPlanTest, ABlockThatDiffersIsAskedForInDetail) {
  for (const std::size_t max_blocks : {16'384u, 0u}) {
    Streets tiles(3);
    SyncRequest request = Ask(DiscArea{{0, 0}, 1'000.0});
    request.held = Hold({}, BlocksOf(tiles));
    const TileId changed = tiles.tiles().begin()->second.id;
    const std::uint64_t emptied = TileBlockOf(tiles.tiles().rbegin()->first);
    tiles.Put(changed, 99);
    for (const auto& [key, tile] : std::map(tiles.tiles())) {
      if (TileBlockOf(key) == emptied) {
        tiles.Remove(tile.id);
      }
    }
    const SyncPlan plan = Plan(request, tiles, {4'096, 262'144, max_blocks});
    EXPECT_THAT(plan.items, IsEmpty());
    EXPECT_THAT(plan.differing,
                ::testing::UnorderedElementsAre(TileBlockOf(changed.Key()), emptied));
  }
}

TEST(SyncPlanTest, TilesBesideAHeldBlocksAreNew) {
  KnownTiles tiles;
  tiles.Put({0, 0, 0}, 1);
  SyncRequest request = Ask(DiscArea{{0, 0}, 100.0});
  request.held = Hold({}, BlocksOf(tiles));
  tiles.Put({0, 1, 1}, 2);
  const SyncPlan plan = Plan(request, tiles);
  EXPECT_THAT(KeysOf(plan.items), ElementsAre(TileId{0, 1, 1}.Key()));
  EXPECT_EQ(plan.not_modified, 1u);
}

TEST(SyncPlanTest, OnlySectionsThatAreMissingAreSent) {
  constexpr SectionMask kSurface = 1u << 2;
  constexpr SectionMask kColumns = 1u << 3;
  KnownTiles tiles;
  tiles.Put({0, 0, 0}, 1);
  tiles.Put({0, 1, 0}, 1);
  SyncRequest request = Ask(DiscArea{{0, 0}, 100.0});
  request.sections = kSurface | kColumns;
  request.held = Hold({{TileId{0, 0, 0}.Key(), 1, kSurface}, {TileId{0, 1, 0}.Key(), 7, kSurface}});
  const SyncPlan plan = Plan(request, tiles);
  ASSERT_EQ(plan.items.size(), 2u);
  for (const SyncItem& item : plan.items) {
    EXPECT_EQ(item.sections, item.tile.id.x == 0 ? kColumns : kSurface | kColumns);
    EXPECT_EQ(item.held_hash, item.tile.id.x == 0 ? 0u : 7u);
  }
  request.sections = kSurface;
  EXPECT_EQ(Plan(request, tiles).items.size(), 1u);
}

TEST(SyncPlanTest, LevelsAreBounded) {
  Streets tiles(4);
  SyncRequest request = Ask(DiscArea{{0, 0}, 500.0});
  request.finest_level = 1;
  request.coarsest_level = 3;
  request.held = Hold({{TileId{0, 999, 999}.Key(), 1}, {TileId{4, 99, 99}.Key(), 1}});
  const SyncPlan plan = Plan(request, tiles);
  for (const SyncItem& item : plan.items) {
    EXPECT_GE(item.tile.id.level, 1);
    EXPECT_LE(item.tile.id.level, 3);
  }
  EXPECT_THAT(plan.removed, IsEmpty());  // nobody asked for those
  request.finest_level = 4;
  const auto refused = PlanSync(request, tiles, SmallProfile(), true);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kInvalidArgument);
}

TEST(SyncPlanTest, ALargeAreaIsScanned) {
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    Streets tiles(seed);
    const SyncRequest request = Ask(AnyShape(seed));
    EXPECT_EQ(KeysOf(Plan(request, tiles, {4'096, 262'144, 0}).items),
              KeysOf(Plan(request, tiles).items));
  }
  Streets tiles(0);
  EXPECT_EQ(Plan(Ask(DiscArea{{0, 0}, 1e12}), tiles).items.size(), tiles.tiles().size());
}

TEST(SyncPlanTest, AnAreaWithTooManyTilesIsRefused) {
  Streets tiles(0);
  const auto refused =
      PlanSync(Ask(DiscArea{{0, 0}, 1e6}), tiles, SmallProfile(), true, {4'096, 100});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kInvalidArgument);
}

TEST(SyncPlanTest, SaysThatItTakesTheDisk) {
  Streets tiles(0);
  const SyncRequest request = Ask(DiscArea{{0, 0}, 300.0});
  EXPECT_TRUE(PlanSync(request, tiles, SmallProfile(), false).value().has_value());
  tiles.ForgetBlock(TileBlockOf(TileId{0, 0, 0}.Key()));
  EXPECT_FALSE(PlanSync(request, tiles, SmallProfile(), false).value().has_value());
  EXPECT_TRUE(PlanSync(request, tiles, SmallProfile(), true).value().has_value());
}

TEST(SyncPlanTest, CertainTilesAreAskedForByTheirKeys) {
  Streets tiles(5);
  std::vector<TileId> ids;
  for (const auto& [key, tile] : tiles.tiles()) {
    if (key % 3 == 0) {
      ids.push_back(tile.id);
    }
  }
  const SyncPlan plan = Plan(Ask(TilesArea{ids}), tiles);
  EXPECT_EQ(plan.items.size(), ids.size());
}

// With 256 points one block is as much as may be done at once.
TEST(SyncPlanTest, ALongWayIsForThePoolBeforeAnyBlockIsLookedAt) {
  Streets tiles(0);
  CorridorArea zigzag{{}, 0.0};
  for (int i = 0; i < 256; ++i) {
    zigzag.route_m.emplace_back(i % 2 * 25'000.0, i * 98.0);
  }
  SyncRequest request = Ask(zigzag);
  request.finest_level = 1;
  request.coarsest_level = 1;
  EXPECT_FALSE(PlanSync(request, tiles, SmallProfile(), false).value().has_value());
  EXPECT_EQ(tiles.lookups(), 0u);
  EXPECT_TRUE(PlanSync(request, tiles, SmallProfile(), true).value().has_value());
}

TEST(SyncPlanTest, ManyHeldTilesAlongALongWayAreForThePool) {
  Streets tiles(0);
  SyncRequest request = Ask(CorridorArea{{{0, 0}, {1, 0}, {2, 0}, {3, 0}}, 0.0});
  EXPECT_TRUE(PlanSync(request, tiles, SmallProfile(), false).value().has_value());
  std::vector<HeldTile> held;
  for (std::int32_t x = 0; x < 5'500; ++x) {
    held.push_back({TileId{0, x, 500}.Key(), 1});
  }
  request.held = Hold(held);
  const std::size_t lookups = tiles.lookups();
  EXPECT_FALSE(PlanSync(request, tiles, SmallProfile(), false).value().has_value());
  EXPECT_EQ(tiles.lookups(), lookups);
}

}  // namespace
}  // namespace atlas
