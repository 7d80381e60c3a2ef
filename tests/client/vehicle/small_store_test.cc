// A store with less room than the disc that a vehicle follows: nothing is sent again and again,
// what is near is fine, and what the map shows is what the atlas has.
#include <random>

#include <gtest/gtest.h>

#include "client/vehicle/atlas_view.h"
#include "client/vehicle/watched_feed.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

constexpr double kSide_m = 1.6;  // of a level-0 tile
constexpr double kRadius_m = 8.0;
const Eigen::Vector2d kMiddle_m(8.5 * kSide_m, 8.5 * kSide_m);
constexpr int kRounds = 6;  // until it settled

class SmallStoreTest : public ::testing::Test {
 protected:
  SmallStoreTest() {
    for (int x = 0; x < 32; ++x) {
      for (int y = 0; y < 16; ++y) {
        world_.Set(x, y, 100 * x + y);
      }
    }
    TileStore large = *TileStore::Open(TinyAtlas(), {.folder = folder_.path() / "large"});
    EXPECT_TRUE(AtlasView(large, &link_).Around(kMiddle_m, kRadius_m)->is_current);
    memory_bytes_ = large.memory_bytes();
    disk_bytes_ = large.disk_bytes();
  }

  // With room for a part of the disc.
  TileStore Store(double part) {
    TileStoreOptions options;
    options.folder = folder_.path() / "small";
    options.max_memory_bytes = static_cast<std::size_t>(part * static_cast<double>(memory_bytes_));
    options.max_disk_bytes = static_cast<std::uint64_t>(part * static_cast<double>(disk_bytes_));
    return *TileStore::Open(TinyAtlas(), options);
  }
  // How many tiles came, over so many calls.
  std::uint64_t TilesOf(AtlasView& view, const Eigen::Vector2d& position_m, int calls) {
    std::uint64_t tiles = 0;
    for (int call = 0; call < calls; ++call) {
      const auto map = view.Around(position_m, kRadius_m);
      EXPECT_TRUE(map);
      EXPECT_FALSE(map->is_current);
      EXPECT_EQ(map->sync.code(), StatusCode::kResourceExhausted) << map->sync.message();
      EXPECT_GT(map->coarse_places, 0U);
      tiles += map->transfer.tiles;
    }
    return tiles;
  }
  void ExpectFineAt(const TileStore& store, const Eigen::Vector2d& position_m) {
    const TileId id{0, static_cast<std::int32_t>(position_m.x() / kSide_m),
                    static_cast<std::int32_t>(position_m.y() / kSide_m)};
    EXPECT_NE(store.Find(id), nullptr) << id;
  }
  void ExpectNothingStale(const TileStore& store) {
    for (const TileId& id : store.TilesIn(DiscArea{kMiddle_m, kRadius_m}, 0)) {
      const auto now = world_.tiles().find(id);
      ASSERT_NE(now, world_.tiles().end()) << id;
      EXPECT_EQ(store.Find(id)->payload_hash, now->second.encoded.payload_hash) << id;
    }
  }

  TestFolder folder_;
  TinyWorld world_;
  SyncPeer peer_{world_};
  AtlasLink link_{LinkOptions{.connection = peer_.options()}};
  std::size_t memory_bytes_ = 0;
  std::uint64_t disk_bytes_ = 0;
};

TEST_F(SmallStoreTest, AVehicleThatStandsIsSentNothingTwice) {
  for (const double part : {0.75, 0.5, 0.25, 0.1}) {
    TileStore store = Store(part);
    AtlasView view(store, &link_);
    EXPECT_GT(TilesOf(view, kMiddle_m, kRounds), 0U);
    EXPECT_EQ(TilesOf(view, kMiddle_m, 10), 0U) << part;
    // Nor when its position is known within some centimetres only.
    EXPECT_EQ(TilesOf(view, kMiddle_m + Eigen::Vector2d(0.02, -0.02), 3), 0U) << part;
    EXPECT_EQ(TilesOf(view, kMiddle_m - Eigen::Vector2d(0.02, -0.02), 3), 0U) << part;
    ExpectFineAt(store, kMiddle_m);
  }
}

TEST_F(SmallStoreTest, WhatTheMapShowsIsWhatTheAtlasHas) {
  TileStore store = Store(0.5);
  AtlasView view(store, &link_);
  TilesOf(view, kMiddle_m, kRounds);
  std::mt19937 random(7);
  for (int change = 0; change < 10; ++change) {
    world_.ChangeSome(random, 32, 40);
    TilesOf(view, kMiddle_m, 2);
    ExpectNothingStale(store);
  }
}

TEST_F(SmallStoreTest, AlongTheWayItIsFineWhereTheVehicleIs) {
  TileStore store = Store(0.5);
  AtlasView view(store, &link_);
  TilesOf(view, kMiddle_m, kRounds);
  for (double x_m = 0.0; x_m < 9.0; x_m += 1.0) {
    const Eigen::Vector2d place_m = kMiddle_m + Eigen::Vector2d(x_m, 0.0);
    TilesOf(view, place_m, 1);
    ExpectFineAt(store, place_m);
    TilesOf(view, place_m, 2);
    EXPECT_EQ(TilesOf(view, place_m, 3), 0U) << x_m;
  }
}

TEST_F(SmallStoreTest, WithAWatchNothingIsSentTwiceEither) {
  TileStore store = Store(0.5);
  WatchedFeed feed(link_, {.margin_m = 3.0});
  AtlasView view(store, feed);
  EXPECT_GT(TilesOf(view, kMiddle_m, kRounds), 0U);
  EXPECT_EQ(TilesOf(view, kMiddle_m, 10), 0U);
  ExpectFineAt(store, kMiddle_m);
}

}  // namespace
}  // namespace atlas
