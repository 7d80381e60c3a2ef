#include "server/service/watch/tile_watch.h"

#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "server/service/watch/watch_hub.h"

namespace atlas {
namespace {

constexpr std::uint32_t kTop = 3;

TileWatch::Scope Everywhere(double radius_m = 1e6) {
  MapProfile profile;
  profile.levels = kTop + 1;
  return {SyncArea::Create(DiscArea{{0, 0}, radius_m}, profile).value(), 0, kTop};
}

TEST(TileWatchTest, TellsTheNewestOfEachTileOnce) {
  int woken = 0;
  TileWatch watch(Everywhere(), [&woken] { ++woken; });
  EXPECT_TRUE(watch.Take().empty());
  watch.Add({0, 1, 2}, 5);
  watch.Add({1, 0, 1}, 6);
  watch.Add({0, 1, 2}, 7);
  watch.Add({0, 4, 4}, 0);
  EXPECT_EQ(woken, 1) << "once for all of them";
  const TileChanges changes = watch.Take();
  EXPECT_EQ(changes.tiles.size(), 3u);
  EXPECT_EQ(changes.tiles.back(), (TileChanges::Tile{{1, 0, 1}, 6})) << "coarse ones last";
  EXPECT_TRUE(changes.below.empty());
  EXPECT_TRUE(watch.Take().empty());
  watch.Add({0, 1, 2}, 8);
  EXPECT_EQ(woken, 2);
}

TEST(TileWatchTest, WhatIsThereWhenItBeginsIsNotToldLate) {
  int woken = 0;
  TileWatch watch(Everywhere(), [&woken] { ++woken; });
  watch.Add({0, 1, 2}, 5);
  watch.Add({0, 2, 2}, 8);
  watch.TellFrom(7);
  EXPECT_EQ(watch.Take().tiles, (std::vector<TileChanges::Tile>{{{0, 2, 2}, 8}}));
  watch.Add({0, 3, 2}, 6);
  watch.Add({0, 4, 2}, 7);
  EXPECT_EQ(woken, 1);
  EXPECT_TRUE(watch.Take().empty());
  watch.Add({0, 3, 2}, 9);
  watch.Add({0, 4, 2}, 0);
  EXPECT_EQ(watch.Take().tiles.size(), 2U)
      << "one is later, of the other nobody knows when it went";
}

TEST(TileWatchTest, HearsOfItsAreaAndLevelsOnly) {
  TileWatch::Scope scope = Everywhere(20.0);
  scope.finest_level = 1;
  scope.coarsest_level = 2;
  TileWatch watch(scope, [] { FAIL(); });
  watch.Add({0, 0, 0}, 1);
  watch.Add({3, 0, 0}, 2);
  watch.Add({1, 100, 0}, 3);
  EXPECT_TRUE(watch.Take().empty());
}

// However many: bounded, and whatever changed is told, itself or from above.
TEST(TileWatchTest, LosesDetailAndNothingElse) {
  std::mt19937 random(11);
  for (int run = 0; run < 200; ++run) {
    const std::size_t max_told = 4 + random() % 40;
    TileWatch watch(
        Everywhere(), [] {}, max_told);
    std::map<std::uint64_t, std::uint64_t> truth;
    const int count = static_cast<int>(random() % 400);
    const int reach = 1 << (1 + random() % 7);
    for (int i = 1; i <= count; ++i) {
      TileId id{static_cast<std::uint8_t>(random() % (kTop + 1)),
                static_cast<std::int32_t>(random()) % reach,
                static_cast<std::int32_t>(random()) % reach};
      truth[id.Key()] = static_cast<std::uint64_t>(i);
      watch.Add(id, static_cast<std::uint64_t>(i));
    }
    const TileChanges told = watch.Take();
    EXPECT_LE(told.tiles.size() + told.below.size(), max_told);
    std::map<std::uint64_t, std::uint64_t> tiles;
    for (const auto& tile : told.tiles) {
      tiles[tile.id.Key()] = tile.revision;
    }
    const std::set<TileId> below(told.below.begin(), told.below.end());
    for (const auto& [key, revision] : truth) {
      bool is_told = told.is_anything || tiles.contains(key);
      EXPECT_TRUE(!tiles.contains(key) || tiles[key] == revision);
      TileId ancestor = TileId::FromKey(key).value();
      while (!is_told && ancestor.level < kTop) {
        ancestor = ancestor.Parent();
        is_told = below.contains(ancestor);
      }
      EXPECT_TRUE(is_told) << TileId::FromKey(key).value();
    }
    EXPECT_EQ(count == 0, told.empty());
  }
}

TEST(TileWatchTest, AHubForgetsWatchesThatAreGone) {
  WatchHub hub;
  auto first = hub.Open(Everywhere(), [] {});
  {
    const auto second = hub.Open(Everywhere(), [] {});
    hub.Publish({0, 0, 0}, 1);
    EXPECT_FALSE(second->Take().empty());
  }
  hub.Publish({0, 0, 0}, 2);
  EXPECT_EQ(first->Take().tiles.at(0).revision, 2u);
}

TEST(TileWatchTest, AHubForgetsThemWhereNothingEverChanges) {
  WatchHub hub;
  const auto stays = hub.Open(Everywhere(), [] {});
  for (int i = 0; i < 10'000; ++i) {
    hub.Open(Everywhere(), [] {});
  }
  EXPECT_LE(hub.listed(), 64u);
  hub.Publish({0, 0, 0}, 1);
  EXPECT_EQ(hub.listed(), 1u);
  EXPECT_FALSE(stays->Take().empty());
}

}  // namespace
}  // namespace atlas
