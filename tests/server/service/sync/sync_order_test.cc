// In which order tiles come, of one reply and of many while tiles change.
#include <map>
#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/service/sync/sync_plan.h"
#include "tests/server/service/sync/known_tiles.h"

namespace atlas {
namespace {

using ::testing::ElementsAre;

SyncCursor Behind(const SyncItem& item, std::uint64_t revision) {
  return {revision, item.priority, item.tile.id.Key()};
}

TEST(SyncOrderTest, TheVehicleIsSharpFirst) {
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

TEST(SyncOrderTest, CheapTilesComeBeforeDearOnes) {
  KnownTiles tiles;
  tiles.Put({1, 0, 0}, 1);
  tiles.Put({0, 0, 0}, 1, 30'000);
  tiles.Put({0, 1, 0}, 1, 1'000);
  SyncRequest request = Ask(BoxArea{{0, 0}, {25.5, 1}});
  request.coarsest_level = 1;
  EXPECT_THAT(KeysOf(Plan(request, tiles).items),
              ElementsAre(TileId{1, 0, 0}.Key(), TileId{0, 1, 0}.Key(), TileId{0, 0, 0}.Key()));
}

TEST(SyncOrderTest, GoesOnWhereTheReplyBeforeEnded) {
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

TEST(SyncOrderTest, WhatChangedAfterItWasSentComesLast) {
  Streets tiles(1);
  SyncRequest request = Ask(DiscArea{{0, 0}, 300.0});
  const SyncPlan whole = Plan(request, tiles);
  request.after = Behind(whole.items[whole.items.size() / 2], tiles.revision());
  const TileId changed = whole.items[1].tile.id;
  tiles.Put(changed, 12'345);
  const auto keys = KeysOf(Plan(request, tiles).items);
  EXPECT_EQ(keys.back(), changed.Key());
  EXPECT_EQ(std::count(keys.begin(), keys.end(), whole.items[0].tile.id.Key()), 0);
}

// Its children are what they were, and would come at their old places.
TEST(SyncOrderTest, AParentThatChangedComesBeforeItsChildren) {
  KnownTiles tiles;
  tiles.Put({2, 0, 0}, 1);
  tiles.Put({1, 0, 0}, 1);
  tiles.Put({0, 0, 0}, 1, 1'000);
  tiles.Put({0, 1, 1}, 1, 1'000);
  SyncRequest request = Ask(DiscArea{{0, 0}, 30.0});
  request.coarsest_level = 2;
  request.after = Behind(Plan(request, tiles, {1}).items.back(), tiles.revision());
  for (const std::uint32_t bytes : {100u, 1'000'000u}) {
    tiles.Put({1, 0, 0}, 2, bytes);
    EXPECT_THAT(KeysOf(Plan(request, tiles).items),
                ElementsAre(TileId{1, 0, 0}.Key(), TileId{0, 0, 0}.Key(), TileId{0, 1, 1}.Key()));
  }
}

TEST(SyncOrderTest, ACoverTileThatChangedStaysInTheCover) {
  KnownTiles tiles;
  for (std::int32_t x = 0; x < 3; ++x) {
    tiles.Put({1, x, 0}, 1);
    tiles.Put({0, 2 * x, 0}, 1, 1);
  }
  SyncRequest request = Ask(BoxArea{{0, 0}, {76, 1}});
  request.coarsest_level = 1;
  const SyncPlan first = Plan(request, tiles, {1});
  ASSERT_EQ(first.items[0].tile.id, (TileId{1, 1, 0}));
  request.after = Behind(first.items[0], tiles.revision());
  tiles.Put({1, 2, 0}, 2, 1'000'000);
  const SyncPlan second = Plan(request, tiles, {2});
  EXPECT_THAT(KeysOf(second.items), ElementsAre(TileId{1, 0, 0}.Key(), TileId{1, 2, 0}.Key()));
}

// Else the place of a child would move past the cursor when its parent has come and is told.
TEST(SyncOrderTest, WhatIsHeldMovesNothing) {
  for (std::uint32_t seed = 0; seed < 30; ++seed) {
    Streets tiles(seed);
    SyncRequest request = Ask(AnyShape(seed));
    const SyncPlan whole = Plan(request, tiles);
    std::vector<HeldTile> held;
    std::vector<std::uint64_t> expected;
    std::mt19937 random(seed);
    for (const SyncItem& item : whole.items) {
      if (random() % 2 == 0) {
        held.push_back({item.tile.id.Key(), item.tile.payload_hash});
      } else {
        expected.push_back(item.tile.id.Key());
      }
    }
    request.held = Hold(held);
    EXPECT_EQ(KeysOf(Plan(request, tiles).items), expected) << seed;
  }
}

// What a vehicle has got so far of replies that follow each other.
class Vehicle {
 public:
  explicit Vehicle(const SyncRequest& request) : request_(request) {}

  // One reply. `tells`: what came is told as held. False: it was the last one.
  bool Ask(KnownTiles& tiles, std::size_t max_items, bool tells) {
    if (!first_revision_) {
      first_revision_ = tiles.revision();
    }
    const SyncPlan plan = Plan(request_, tiles, {max_items});
    for (const SyncItem& item : plan.items) {
      Take(item.tile);
    }
    if (plan.is_cut) {
      request_.after = Behind(plan.items.back(), *first_revision_);
    }
    if (tells) {
      request_.held = Hold(held());
    }
    return plan.is_cut;
  }
  const std::map<std::uint64_t, std::uint64_t>& revisions() const { return revisions_; }
  std::uint64_t first_revision() const { return *first_revision_; }

 private:
  void Take(const TileSummary& tile) {
    const std::uint64_t key = tile.id.Key();
    const bool is_cover = tile.id.level == 4;
    EXPECT_TRUE(is_cover || revisions_.contains(tile.id.Parent().Key())) << tile.id;
    EXPECT_TRUE(is_cover_ || !is_cover || revisions_.contains(key)) << tile.id << " late";
    is_cover_ = is_cover_ && is_cover;
    EXPECT_TRUE(!revisions_.contains(key) || tile.revision > *first_revision_)
        << tile.id << " twice";
    revisions_[key] = tile.revision;
    hashes_[key] = tile.payload_hash;
  }
  std::vector<HeldTile> held() const {
    std::vector<HeldTile> held;
    for (const auto& [key, hash] : hashes_) {
      held.push_back({key, hash});
    }
    return held;
  }

  SyncRequest request_;
  std::optional<std::uint64_t> first_revision_;
  std::map<std::uint64_t, std::uint64_t> revisions_;  // of what came
  std::map<std::uint64_t, std::uint64_t> hashes_;
  bool is_cover_ = true;  // nothing else came yet
};

TEST(SyncOrderTest, NothingIsLostNorBeforeItsParentWhileTilesChange) {
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    Streets tiles(seed);
    std::mt19937 random(seed);
    const SyncRequest request = Ask(AnyShape(seed));
    const std::map<std::uint64_t, TileSummary> before = tiles.tiles();
    Vehicle vehicle(request);
    while (vehicle.Ask(tiles, 1 + random() % 12, seed % 2 == 0)) {
      for (int i = 0; i < 3; ++i) {
        const auto any = std::next(before.begin(), static_cast<int>(random() % before.size()));
        tiles.Put(any->second.id, random(), static_cast<std::uint32_t>(100 + random() % 200'000));
      }
    }
    for (const std::uint64_t key : Touched(request.area, tiles)) {
      ASSERT_TRUE(vehicle.revisions().contains(key)) << TileId::FromKey(key).value();
      EXPECT_GE(vehicle.revisions().at(key), before.at(key).revision);
    }
  }
}

// An area with a way that comes back: a large tile may touch it first where it is farther along.
TEST(SyncOrderTest, ParentsFirstAlongAWindingWay) {
  std::mt19937 random(5);
  const auto place_m = [&] {
    return static_cast<double>(random() % 600) - 300.0;
  };
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    Streets tiles(seed);
    CorridorArea corridor{{}, 60.0};
    for (int i = 0; i < 30; ++i) {
      corridor.route_m.emplace_back(place_m(), place_m());
    }
    std::set<std::uint64_t> sent;
    for (const SyncItem& item : Plan(Ask(corridor), tiles).items) {
      const TileId id = item.tile.id;
      EXPECT_TRUE(id.level == 4 || sent.contains(id.Parent().Key())) << seed << ": " << id;
      sent.insert(id.Key());
    }
  }
}

}  // namespace
}  // namespace atlas
