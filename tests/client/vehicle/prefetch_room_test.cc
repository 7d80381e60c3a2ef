// What a route brings into a store that is small: never at the cost of the map around the vehicle.
#include <algorithm>

#include <gtest/gtest.h>

#include "client/vehicle/atlas_view.h"
#include "tests/client/vehicle/dense_tile.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

using Eigen::Vector2d;

constexpr double kRadius_m = 4.0;
constexpr double kHalfWidth_m = 2.0;
const Vector2d kPlace_m(4.0, 4.0);
const std::vector<Vector2d> kRoute_m = {kPlace_m, {70.0, 4.0}};

// A wide road that leads east, with two surfaces in places.
const TinyWorld& World() {
  static const TinyWorld world = [] {
    TinyWorld made;
    for (int x = 0; x < 44; ++x) {
      for (int y = 0; y < 6; ++y) {
        if (x % 4 == 0) made.Put(DenseTile(x, y));
        if (x % 4 != 0) made.Set(x, y, 100 * x + y);
      }
    }
    return made;
  }();
  return world;
}

class PrefetchRoomTest : public ::testing::Test {
 protected:
  PrefetchRoomTest() {
    TileStore large = StoreOf(std::size_t{1} << 28);
    AtlasView view(large, &link_);
    EXPECT_TRUE(view.Around(kPlace_m, kRadius_m, options_)->is_current);
    disc_bytes_ = large.held_bytes();
    const auto all = view.Prefetch(kRoute_m, kHalfWidth_m, options_);
    EXPECT_TRUE(all && all->is_complete && all->has_room && all->sync.ok());
    all_bytes_ = large.held_bytes();
    EXPECT_GT(all_bytes_, 4 * disc_bytes_);
  }

  static TileStore StoreOf(std::size_t bytes) {
    return *TileStore::Open(TinyAtlas(), {.max_memory_bytes = bytes});
  }
  StoreSyncReport Prefetch(AtlasView& view) const {
    auto report = view.Prefetch(kRoute_m, kHalfWidth_m, options_);
    EXPECT_TRUE(report) << report.error().message();
    return *std::move(report);
  }
  // Which the route does not all fit beside.
  void ExpectTheDiscStays(TileStore& store) {
    AtlasView view(store, &link_);
    ASSERT_TRUE(view.Around(kPlace_m, kRadius_m, options_)->is_current);
    const auto around = store.TilesIn(DiscArea{kPlace_m, kRadius_m}, 0);
    for (int call = 0; call < 3; ++call) {
      const std::size_t held = store.size();
      const StoreSyncReport report = Prefetch(view);
      EXPECT_FALSE(report.has_room);
      EXPECT_FALSE(report.is_complete);
      EXPECT_EQ(report.sync.code(), StatusCode::kResourceExhausted);
      EXPECT_EQ(store.size(), held + report.tiles) << "none twice, none gone";
      for (const TileId& id : around) {
        EXPECT_NE(store.Find(id), nullptr) << id;
      }
      const auto map = view.Around(kPlace_m, kRadius_m, options_);
      EXPECT_TRUE(map->is_current) << map->sync.message();
      EXPECT_EQ(map->transfer.tiles, 0U);
    }
  }

  SyncPeer peer_{World()};
  AtlasLink link_{LinkOptions{.connection = peer_.options()}};
  AroundOptions options_{.deadline = std::chrono::seconds(60)};
  std::uint64_t disc_bytes_ = 0;
  std::uint64_t all_bytes_ = 0;
};

TEST_F(PrefetchRoomTest, ARouteTakesNothingOfTheDisc) {
  for (const double part : {0.0, 0.02, 0.1, 0.3, 0.6, 0.9}) {
    SCOPED_TRACE(part);
    const double beside = part * static_cast<double>(all_bytes_ - disc_bytes_);
    TileStore store = StoreOf(disc_bytes_ + static_cast<std::size_t>(beside));
    ExpectTheDiscStays(store);
  }
}

TEST_F(PrefetchRoomTest, WhatTheDiskCanHoldCounts) {
  const TestFolder folder;
  TileStore store = *TileStore::Open(TinyAtlas(), {.max_memory_bytes = disc_bytes_ / 4,
                                                   .folder = folder.path(),
                                                   .max_disk_bytes = 2 * disc_bytes_});
  EXPECT_EQ(store.capacity_bytes(), 2 * disc_bytes_);
  ExpectTheDiscStays(store);
  EXPECT_GT(store.held_bytes(), disc_bytes_ * 3 / 2) << "as far as it has room";
}

TEST_F(PrefetchRoomTest, WithoutRoomForAnythingNothingIsAsked) {
  TileStore store = StoreOf(disc_bytes_ + 50);
  AtlasView view(store, &link_);
  ASSERT_TRUE(view.Around(kPlace_m, kRadius_m, options_)->is_current);
  const int syncs = peer_.syncs();
  EXPECT_FALSE(Prefetch(view).has_room);
  EXPECT_EQ(peer_.syncs(), syncs);
}

TEST_F(PrefetchRoomTest, WithRoomForAllOfItAllComes) {
  TileStore store = StoreOf(all_bytes_ * 3 / 2);
  AtlasView view(store, &link_);
  ASSERT_TRUE(view.Around(kPlace_m, kRadius_m, options_)->is_current);
  const StoreSyncReport report = Prefetch(view);
  EXPECT_TRUE(report.is_complete);
  EXPECT_TRUE(report.has_room);
  EXPECT_TRUE(report.sync.ok());
  EXPECT_EQ(Prefetch(view).tiles, 0U);
}

// What was of use elsewhere makes room.
TEST_F(PrefetchRoomTest, WhatIsElsewhereGoesFirst) {
  TileStore store = StoreOf(all_bytes_ * 11 / 10);
  AtlasView view(store, &link_);
  ASSERT_TRUE(view.Around({40.0, 4.0}, 20.0, options_)->is_current);
  ASSERT_TRUE(view.Around(kPlace_m, kRadius_m, options_)->is_current);
  EXPECT_TRUE(view.Prefetch({kPlace_m, {12.0, 4.0}}, kHalfWidth_m, options_)->has_room);
  const auto map = view.Around(kPlace_m, kRadius_m, options_);
  EXPECT_EQ(map->transfer.tiles, 0U);
}

// Though its tiles came later than those of the disc and of the route that is asked for again.
TEST_F(PrefetchRoomTest, AnEarlierRouteGoesFirst) {
  const auto fetch = [&](AtlasView& view, double from_m, double to_m) {
    const auto report = view.Prefetch({{from_m, 4.0}, {to_m, 4.0}}, 0.1, options_);
    EXPECT_TRUE(report) << report.error().message();
    return report->tiles;
  };
  TileStore store = StoreOf(2 * disc_bytes_);
  AtlasView view(store, &link_);
  ASSERT_TRUE(view.Around(kPlace_m, kRadius_m, options_)->is_current);
  EXPECT_GT(fetch(view, 14.0, 20.0), 4U);
  const auto along = store.TilesIn(CorridorArea{{{14.0, 4.0}, {20.0, 4.0}}, 0.1}, 0);
  EXPECT_GT(fetch(view, 40.0, 70.0), 4U);
  EXPECT_GT(fetch(view, 14.0, 30.0), 4U);
  EXPECT_LT(store.TilesIn(CorridorArea{{{40.0, 4.0}, {70.0, 4.0}}, 0.1}, 0).size(), 40U);
  for (const TileId& id : along) {
    EXPECT_NE(store.Find(id), nullptr) << id;
  }
  const auto map = view.Around(kPlace_m, kRadius_m, options_);
  EXPECT_EQ(map->transfer.tiles, 0U);
  EXPECT_TRUE(map->is_current) << map->sync.message();
}

TEST_F(PrefetchRoomTest, ABudgetThatEndsIsNoLackOfRoom) {
  for (const bool is_full : {false, true}) {
    TileStore store = StoreOf(is_full ? 3 * disc_bytes_ : all_bytes_);
    AtlasView view(store, &link_);
    options_.budget_bytes = 0;
    if (is_full) {
      EXPECT_FALSE(view.Prefetch({{30.0, 4.0}, {70.0, 4.0}}, 5.0, options_)->has_room);
    }
    ASSERT_TRUE(view.Around(kPlace_m, kRadius_m, options_)->is_current);
    options_.budget_bytes = disc_bytes_ / 2;
    EXPECT_EQ(store.held_bytes() + options_.budget_bytes > store.capacity_bytes(), is_full);
    const StoreSyncReport report = Prefetch(view);
    EXPECT_FALSE(report.is_complete);
    EXPECT_TRUE(report.has_room) << is_full;
    EXPECT_GT(report.tiles, 0U);
  }
}

// Of a disc that is followed in part, the rest along the route comes with the route, and stays as
// long as that is asked for.
TEST_F(PrefetchRoomTest, BesideADiscInPartARouteComesOnce) {
  constexpr double kFar_m = 30.0;
  const std::vector<Vector2d> route_m = {kPlace_m, {kPlace_m.x() + 20.0, kPlace_m.y()}};
  TileStore store = StoreOf(all_bytes_ / 2);
  AtlasView view(store, &link_);
  std::uint64_t tiles = 0;
  for (int call = 0; call < 12; ++call) {
    const auto map = view.Around(kPlace_m, kFar_m, options_);
    EXPECT_EQ(map->sync.code(), StatusCode::kResourceExhausted);
    const auto report = view.Prefetch(route_m, 0.1, options_);
    ASSERT_TRUE(report);
    EXPECT_TRUE(call < 8 || report->is_complete) << call;
    tiles = call < 8 ? 0 : tiles + map->transfer.tiles + report->tiles;
  }
  EXPECT_EQ(tiles, 0U);
  EXPECT_NE(store.Find({0, 13, 2}), nullptr);
  for (int call = 0; call < 2; ++call) {
    ASSERT_TRUE(view.Around(kPlace_m, kFar_m, options_));
  }
  EXPECT_EQ(store.Find({0, 13, 2}), nullptr) << "nobody asks whether it changed";
}

TEST_F(PrefetchRoomTest, ARouteThatMakesNoSenseIsRefused) {
  TileStore store = StoreOf(all_bytes_);
  AtlasView view(store, &link_);
  const auto report = view.Prefetch({}, kHalfWidth_m, options_);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
