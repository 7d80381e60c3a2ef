#include "server/service/sync/sync_plan.h"

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace atlas {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

MapProfile SmallProfile() {
  MapProfile profile;
  profile.levels = 5;
  return profile;
}

// Tiles in memory.
class KnownTiles : public TileIndex {
 public:
  void Put(const TileId& id, std::uint64_t hash, std::uint32_t bytes = 20'000) {
    tiles_[id.Key()] = {id, ++revision_, hash, bytes};
  }
  void Remove(const TileId& id) { tiles_.erase(id.Key()); }
  const std::map<std::uint64_t, TileSummary>& tiles() const { return tiles_; }
  std::uint64_t revision() const { return revision_; }
  void ForgetBlock(std::uint64_t block) { forgotten_.insert(block); }

  Result<TileBlock> ReadTileBlock(std::uint64_t block) override {
    std::vector<TileSummary> tiles;
    for (auto it = tiles_.lower_bound(FirstKeyOf(block));
         it != tiles_.end() && TileBlockOf(it->first) == block; ++it) {
      tiles.push_back(it->second);
    }
    return std::make_shared<const std::vector<TileSummary>>(std::move(tiles));
  }
  TileBlock FindTileBlock(std::uint64_t block) override {
    return forgotten_.contains(block) ? nullptr : *ReadTileBlock(block);
  }
  Status ScanTiles(const TileRect& rect,
                   const std::function<void(const TileSummary&)>& visit) override {
    for (const auto& [key, tile] : tiles_) {
      if (rect.Contains(tile.id)) {
        visit(tile);
      }
    }
    return {};
  }

 private:
  std::map<std::uint64_t, TileSummary> tiles_;
  std::set<std::uint64_t> forgotten_;
  std::uint64_t revision_ = 0;
};

// Streets of level-0 tiles, and all tiles above them.
class Streets : public KnownTiles {
 public:
  explicit Streets(std::uint32_t seed) {
    std::mt19937 random(seed);
    std::set<TileId> all;
    for (int street = 0; street < 6; ++street) {
      const auto at = static_cast<std::int32_t>(random() % 60) - 30;
      for (std::int32_t along = -30; along < 30; ++along) {
        all.insert(street % 2 == 0 ? TileId{0, along, at} : TileId{0, at, along});
      }
    }
    for (std::uint8_t level = 0; level + 1 < SmallProfile().levels; ++level) {
      for (const TileId& id : std::set<TileId>(all)) {
        if (id.level == level) {
          all.insert(id.Parent());
        }
      }
    }
    for (const TileId& id : all) {
      Put(id, random(), static_cast<std::uint32_t>(1'000 + random() % 40'000));
    }
  }
};

SyncArea Area(MapArea shape) {
  return SyncArea::Create(std::move(shape), SmallProfile()).value();
}
SyncRequest Ask(MapArea shape) {
  return {Area(std::move(shape)), 0, 0, kAllSections, {}, {}};
}
MapArea AnyShape(std::uint32_t seed) {
  const double x_m = seed % 7 * 40.0 - 120.0;
  switch (seed % 3) {
    case 0:
      return DiscArea{{x_m, 5.0}, 30.0 + seed % 5 * 60.0};
    case 1:
      return BoxArea{{x_m, -100.0}, {x_m + 150.0, 200.0}};
    default:
      return CorridorArea{{{x_m, -300.0}, {0.0, 0.0}, {300.0, x_m}}, 40.0};
  }
}

SyncPlan Plan(const SyncRequest& request, KnownTiles& tiles, const SyncLimits& limits = {}) {
  auto plan = PlanSync(request, tiles, SmallProfile(), true, limits);
  EXPECT_TRUE(plan.has_value()) << plan.error().message();
  return **std::move(plan);
}

std::vector<std::uint64_t> KeysOf(const std::vector<SyncItem>& items) {
  std::vector<std::uint64_t> keys;
  for (const SyncItem& item : items) {
    keys.push_back(item.tile.id.Key());
  }
  return keys;
}

std::set<std::uint64_t> Touched(const SyncArea& area, const KnownTiles& tiles) {
  std::set<std::uint64_t> keys;
  for (const auto& [key, tile] : tiles.tiles()) {
    if (area.Touches(tile.id)) {
      keys.insert(key);
    }
  }
  return keys;
}

HeldTiles Hold(std::vector<HeldTile> tiles, std::vector<HeldBlock> blocks = {}) {
  return HeldTiles::Create(std::move(tiles), std::move(blocks)).value();
}

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

TEST(SyncPlanTest, TheVehicleIsSharpFirst) {
  KnownTiles tiles;
  for (std::uint8_t level = 0; level < 5; ++level) {
    for (std::int32_t x = -32 >> level; x < 32 >> level; ++x) {
      tiles.Put({level, x, 0}, 1);
    }
  }
  const SyncPlan plan = Plan(Ask(DiscArea{{6.4, 6.4}, 400.0}), tiles);
  const std::vector<std::uint64_t> keys = KeysOf(plan.items);
  const auto place = [&](const TileId& id) {
    return std::find(keys.begin(), keys.end(), id.Key());
  };
  EXPECT_LT(place({0, 0, 0}), place({0, 5, 0}));
  EXPECT_LT(place({0, 0, 0}), place({1, 10, 0}));  // fine here before medium there
  EXPECT_LT(place({2, 5, 0}), place({0, 20, 0}));
  EXPECT_LT(place({1, 4, 0}), place({0, 12, 0}));
}

TEST(SyncPlanTest, CheapTilesComeBeforeDearOnes) {
  KnownTiles tiles;
  tiles.Put({1, 0, 0}, 1);
  tiles.Put({0, 0, 0}, 1, 30'000);
  tiles.Put({0, 1, 0}, 1, 1'000);
  SyncRequest request = Ask(BoxArea{{0, 0}, {25.5, 1}});
  request.coarsest_level = 1;
  EXPECT_THAT(KeysOf(Plan(request, tiles).items),
              ElementsAre(TileId{1, 0, 0}.Key(), TileId{0, 1, 0}.Key(), TileId{0, 0, 0}.Key()));
}

TEST(SyncPlanTest, GoesOnWhereTheReplyBeforeEnded) {
  for (std::uint32_t seed = 0; seed < 30; ++seed) {
    Streets tiles(seed);
    SyncRequest request = Ask(AnyShape(seed));
    const std::vector<std::uint64_t> whole = KeysOf(Plan(request, tiles).items);
    std::vector<std::uint64_t> pieces;
    for (bool is_cut = true; is_cut;) {
      const SyncPlan plan = Plan(request, tiles, {7});
      is_cut = plan.is_cut;
      for (const std::uint64_t key : KeysOf(plan.items)) {
        pieces.push_back(key);
      }
      if (is_cut) {
        const SyncItem& last = plan.items.back();
        request.after = SyncCursor{tiles.revision(), last.priority, last.tile.id.Key()};
      }
    }
    EXPECT_EQ(pieces, whole) << seed;
  }
}

TEST(SyncPlanTest, WhatChangedMeanwhileComesLast) {
  Streets tiles(1);
  SyncRequest request = Ask(DiscArea{{0, 0}, 300.0});
  const SyncPlan first = Plan(request, tiles, {5});
  const SyncItem& last = first.items.back();
  request.after = SyncCursor{tiles.revision(), last.priority, last.tile.id.Key()};
  const TileId changed = first.items[1].tile.id;
  tiles.Put(changed, 12'345);
  const auto keys = KeysOf(Plan(request, tiles).items);
  EXPECT_EQ(keys.back(), changed.Key());
  EXPECT_EQ(std::count(keys.begin(), keys.end(), first.items[0].tile.id.Key()), 0);
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

}  // namespace
}  // namespace atlas
