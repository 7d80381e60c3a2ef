// The map around a vehicle with a link, with a poor one, and with none.
#include "client/vehicle/atlas_view.h"

#include <fstream>

#include <gtest/gtest.h>

#include "proto/wire/convert.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

AtlasLink LinkTo(const SyncPeer& peer) {
  LinkOptions options;
  options.connection = peer.options();
  return AtlasLink(options);
}

std::vector<TileId> IdsOf(const MapAround& map) {
  std::vector<TileId> ids;
  for (const auto& tile : map.tiles) {
    ids.push_back(tile->id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

constexpr double kSide_m = 1.6;  // of a level-0 tile
const Eigen::Vector2d kMiddle(4 * kSide_m, 4 * kSide_m);

TEST(AtlasViewTest, EverythingAroundIsFinestAndSharedFromThenOn) {
  const TinyWorld world = SquareWorld(8);
  SyncPeer peer(world);
  AtlasLink link = LinkTo(peer);
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  AtlasView view(store, &link);
  const auto map = view.Around(kMiddle, 0.5);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_TRUE(map->is_current) << map->sync.message();
  EXPECT_TRUE(map->is_finest_everywhere());
  EXPECT_EQ(IdsOf(*map), (std::vector<TileId>{{0, 3, 3}, {0, 3, 4}, {0, 4, 3}, {0, 4, 4}}));
  EXPECT_EQ(map->revision, world.revision());
  const auto again = view.Around(kMiddle, 0.5);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->transfer.tiles, 0U);
  EXPECT_EQ(again->tiles, map->tiles);  // the same objects
}

TEST(AtlasViewTest, PlacesWithoutAMapAreNotMissing) {
  const TinyWorld world = SquareWorld(3);
  SyncPeer peer(world);
  AtlasLink link = LinkTo(peer);
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  AtlasView view(store, &link);
  const auto map = view.Around({0.0, 0.0}, 20.0);
  ASSERT_TRUE(map);
  EXPECT_TRUE(map->is_finest_everywhere());
  EXPECT_EQ(map->tiles.size(), 9U);
}

TEST(AtlasViewTest, ASmallBudgetLeavesParentsWhereTheFineOnesAreMissing) {
  const TinyWorld world = SquareWorld(8);
  SyncPeer peer(world);
  AtlasLink link = LinkTo(peer);
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  AtlasView view(store, &link);
  AroundOptions options;
  options.budget_bytes = 6'000;
  std::uint64_t missing = ~std::uint64_t{0};
  for (int call = 0; call < 40; ++call) {
    const auto map = view.Around(kMiddle, 5.0, options);
    ASSERT_TRUE(map);
    ASSERT_TRUE(map->sync.ok()) << map->sync.message();
    EXPECT_LE(map->transfer.bytes, options.budget_bytes);
    ASSERT_FALSE(map->tiles.empty());
    EXPECT_EQ(map->is_finest_everywhere(), map->coarse_places == 0);
    if (map->is_current) {
      EXPECT_TRUE(map->is_finest_everywhere());
      EXPECT_EQ(map->tiles.size(), map->finest_places);
      return;
    }
    missing = map->coarse_places;
    EXPECT_GE(map->tiles.front()->id.level, map->tiles.back()->id.level);
  }
  FAIL() << missing << " places are still coarse";
}

TEST(AtlasViewTest, OfflineItAnswersFromWhatIsHeld) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(4);
  const TileStoreOptions options{.folder = folder.path()};
  {
    SyncPeer peer(world);
    AtlasLink link = LinkTo(peer);
    TileStore store = *TileStore::Open(TinyAtlas(), options);
    ASSERT_TRUE(AtlasView(store, &link).Prefetch({{0.0, 0.0}, {6.0, 6.0}}, 3.0, {}));
  }
  TileStore store = *TileStore::Open(KnownAtlases(folder.path()).at(0), options);
  AtlasView view(store, nullptr);
  const auto map = view.Around({3.2, 3.2}, 10.0);
  ASSERT_TRUE(map) << map.error().message();
  EXPECT_EQ(map->sync.code(), StatusCode::kUnavailable);
  EXPECT_FALSE(map->is_current);
  EXPECT_EQ(map->tiles.size(), 16U);
  EXPECT_TRUE(map->is_finest_everywhere());
}

TEST(AtlasViewTest, ACutLinkLeavesAMapAndTheNextCallCompletesIt) {
  const TinyWorld world = SquareWorld(8);
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  {
    SyncPeer peer(world, 20);
    AtlasLink link = LinkTo(peer);
    const auto map = AtlasView(store, &link).Around(kMiddle, 5.0);
    ASSERT_TRUE(map);
    EXPECT_FALSE(map->sync.ok());
    EXPECT_FALSE(map->tiles.empty());
    EXPECT_GT(map->coarse_places, 0U);
    EXPECT_FALSE(link.is_connected());
  }
  const std::size_t held = store.size();
  EXPECT_GT(held, 0U);
  SyncPeer peer(world);
  AtlasLink link = LinkTo(peer);
  const auto map = AtlasView(store, &link).Around(kMiddle, 5.0);
  ASSERT_TRUE(map);
  EXPECT_TRUE(map->is_current) << map->sync.message();
  EXPECT_TRUE(map->is_finest_everywhere());
  EXPECT_EQ(map->transfer.tiles, store.size() - held);
}

TEST(AtlasViewTest, ADamagedFileIsFetchedAgainInTheSameCall) {
  const TestFolder folder;
  const TinyWorld world = SquareWorld(2);
  const TileStoreOptions options{.folder = folder.path()};
  for (int run = 0; run < 2; ++run) {
    SyncPeer peer(world);
    AtlasLink link = LinkTo(peer);
    TileStore store = *TileStore::Open(TinyAtlas(), options);
    const auto map = AtlasView(store, &link).Around({1.6, 1.6}, 1.0);
    ASSERT_TRUE(map);
    EXPECT_TRUE(map->is_current);
    EXPECT_EQ(map->tiles.size(), 4U);
    EXPECT_EQ(map->transfer.tiles, run == 0 ? world.tiles().size() : 1U);
    for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
      const bool is_one = entry.path().filename().string().starts_with("0300000000000000-");
      if (is_one) fs::resize_file(entry.path(), 90);
    }
  }
}

TEST(AtlasViewTest, AStoreWithoutRoomForTheDiscSaysSo) {
  const TinyWorld world = SquareWorld(8);
  SyncPeer peer(world);
  AtlasLink link = LinkTo(peer);
  TileStore large = *TileStore::Open(TinyAtlas(), {});
  ASSERT_TRUE(AtlasView(large, &link).Around(kMiddle, 5.0)->is_current);
  TileStore store = *TileStore::Open(TinyAtlas(), {.max_memory_bytes = large.memory_bytes() / 2});
  AtlasView view(store, &link);
  for (int call = 0; call < 2; ++call) {
    const auto map = view.Around(kMiddle, 5.0);
    ASSERT_TRUE(map);
    EXPECT_FALSE(map->is_current);
    EXPECT_EQ(map->sync.code(), StatusCode::kResourceExhausted) << map->sync.message();
    EXPECT_GT(map->coarse_places, 0U);
    EXPECT_FALSE(map->tiles.empty());
  }
  // What goes is elsewhere.
  const auto near = view.Around(kMiddle, 0.5);
  ASSERT_TRUE(near);
  EXPECT_TRUE(near->is_current) << near->sync.message();
  EXPECT_TRUE(near->is_finest_everywhere());
}

// Although its tiles are decoded already, and not read from the store again.
TEST(AtlasViewTest, WhatIsLookedAtAllTheTimeStays) {
  const TinyWorld world = SquareWorld(8);
  SyncPeer peer(world);
  AtlasLink link = LinkTo(peer);
  TileStore large = *TileStore::Open(TinyAtlas(), {});
  ASSERT_TRUE(AtlasView(large, &link).Around(kMiddle, 20.0)->is_current);
  TileStore store = *TileStore::Open(TinyAtlas(), {.max_memory_bytes = large.memory_bytes() / 2});
  AtlasView view(store, &link);
  const Eigen::Vector2d corner(0.8, 0.8);
  ASSERT_TRUE(view.Around(corner, 0.5)->is_current);
  for (int x = 1; x < 8; ++x) {
    for (int y = 1; y < 8; ++y) {
      ASSERT_TRUE(view.Around({kSide_m * x + 0.8, kSide_m * y + 0.8}, 0.5)->is_current);
      EXPECT_EQ(view.Around(corner, 0.5)->transfer.tiles, 0U) << x << ' ' << y;
    }
  }
}

TEST(AtlasViewTest, ABusyDaemonKeepsItsLinkAndIsAskedNothingForAsLongAsItWants) {
  int syncs = 0;
  {
    TestPeer busy([&syncs](PeerSocket& socket) {
      wire::Envelope greeting;
      wire::HelloReply& hello = *greeting.mutable_hello_reply();
      hello.set_protocol_major(kProtocolMajor);
      hello.set_protocol_minor(kProtocolMinor);
      hello.set_profile(ProfileToWire(TinyProfile()));
      hello.set_atlas_id(BytesToWire(TinyAtlas().atlas_id));
      socket.Reply(socket.ReadRequest()->request_id(), std::move(greeting));
      while (const auto request = socket.ReadRequest()) {
        ++syncs;
        wire::Envelope reply;
        *reply.mutable_error() = ErrorToWire({StatusCode::kUnavailable, "busy"});
        reply.mutable_error()->set_retry_after_ms(60'000);
        socket.Reply(request->request_id(), std::move(reply));
      }
    });
    AtlasLink link({.connection = busy.options()});
    TileStore store = *TileStore::Open(TinyAtlas(), {});
    AtlasView view(store, &link);
    for (int call = 0; call < 5; ++call) {
      const auto map = view.Around(kMiddle, 1.0);
      ASSERT_TRUE(map);
      EXPECT_EQ(map->sync.code(), StatusCode::kUnavailable) << map->sync.message();
      EXPECT_TRUE(link.is_connected());
    }
  }
  EXPECT_EQ(syncs, 1);
}

TEST(AtlasViewTest, WhatMakesNoSenseIsRefused) {
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  AtlasView view(store, nullptr);
  AroundOptions no_surface;
  no_surface.sections = 1U << 3U;
  EXPECT_EQ(view.Around({0, 0}, 1.0, no_surface).error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(view.Around({NAN, 0}, 1.0).error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(view.Around({0, 0}, -1.0).error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
