// A call for the map ends at its deadline whatever the link does, and what was on its way then is
// neither lost nor sent twice.
#include <chrono>

#include <gtest/gtest.h>

#include "client/vehicle/atlas_view.h"
#include "client/vehicle/store_sync.h"
#include "tests/client/support/gated_resolver.h"
#include "tests/client/vehicle/sync_peer.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Far below the connection's own time for a frame.
constexpr milliseconds kDeadline{800};
const DiscArea kEverything{{0.0, 0.0}, 50.0};

class ViewDeadlineTest : public ::testing::Test {
 protected:
  ViewDeadlineTest() {
    for (int x = 0; x < 6; ++x) {
      for (int y = 0; y < 6; ++y) {
        world_.Set(x, y, 100 * x + y);
      }
    }
    atlas_tiles_ = world_.tiles().size();
  }

  static AtlasLink LinkTo(const SyncPeer& peer, milliseconds request_timeout) {
    LinkOptions options;
    options.connection = peer.options();
    options.connection.request_timeout = request_timeout;
    options.connection.connect_timeout = std::chrono::seconds(20);
    return AtlasLink(options);
  }

  static MapAround Around(AtlasView& view) {
    AroundOptions options;
    options.deadline = kDeadline;
    const Clock::time_point start = Clock::now();
    const auto map = view.Around(kEverything.center_m, kEverything.radius_m, options);
    EXPECT_LT(Clock::now() - start, kDeadline + testing::Slack(700));
    EXPECT_TRUE(map) << map.error().message();
    return map.value_or(MapAround());
  }

  TinyWorld world_;
  std::size_t atlas_tiles_ = 0;
};

TEST_F(ViewDeadlineTest, ALinkThatIsSlowerThanACallConnectsOverSeveral) {
  SyncPeer peer(world_);  // takes one connection and no more
  peer.HoldGreeting();
  AtlasLink link = LinkTo(peer, std::chrono::seconds(30));
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  AtlasView view(store, &link);
  for (int call = 0; call < 3; ++call) {
    const MapAround map = Around(view);
    EXPECT_EQ(map.sync.code(), StatusCode::kUnavailable) << map.sync.message();
    EXPECT_FALSE(link.is_connected());
  }
  peer.Release();
  MapAround last = Around(view);
  for (int call = 0; call < 20 && !last.is_current; ++call) {
    last = Around(view);
  }
  EXPECT_TRUE(last.is_current) << last.sync.message();
  EXPECT_EQ(store.size(), atlas_tiles_);
}

TEST_F(ViewDeadlineTest, ANameServerThatNeverAnswersHoldsNoCall) {
  const GatedResolver silent;
  LinkOptions options;
  options.connection.endpoint.host = "daemon";
  options.connection.names = std::make_shared<NameLookup>(silent.resolver());
  options.connection.connect_timeout = 2 * kDeadline;
  options.first_delay = milliseconds(1);
  AtlasLink link(options);
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  AtlasView view(store, &link);
  for (int call = 0; call < 6; ++call) {
    EXPECT_FALSE(Around(view).sync.ok());
  }
  EXPECT_EQ(silent.asked().size(), 1U) << "whatever the number of attempts";
}

TEST_F(ViewDeadlineTest, WhatASilentLinkHadOnItsWayComesWithTheNextCallAndOnlyOnce) {
  // In the first frame, in the manifest or the tile of a pair, and in the end.
  const int frames = static_cast<int>(2 * atlas_tiles_) + 2;
  for (const int silent_after : {0, 1, 2, 15, 16, frames - 1}) {
    SyncPeer peer(world_);
    peer.FallSilentAfter(silent_after);
    AtlasLink link = LinkTo(peer, std::chrono::seconds(30));
    TileStore store = *TileStore::Open(TinyAtlas(), {});
    AtlasView view(store, &link);
    const MapAround first = Around(view);
    EXPECT_TRUE(first.sync.ok()) << first.sync.message();
    EXPECT_FALSE(first.is_current);
    EXPECT_EQ(first.transfer.tiles, store.size());
    EXPECT_EQ(store.size(), static_cast<std::size_t>(std::max(0, (silent_after - 1) / 2)));
    ASSERT_TRUE(link.is_connected());
    EXPECT_FALSE(Around(view).is_current) << "still silent";
    peer.Release();
    MapAround last = Around(view);
    for (int call = 0; call < 20 && !last.is_current; ++call) {
      last = Around(view);
    }
    EXPECT_TRUE(last.is_current) << silent_after;
    EXPECT_TRUE(last.is_finest_everywhere());
    EXPECT_EQ(store.size(), atlas_tiles_);
    EXPECT_EQ(static_cast<std::size_t>(peer.tiles_sent()), atlas_tiles_);
  }
}

TEST_F(ViewDeadlineTest, ALinkThatIsSilentForLongerThanARequestMayTakeIsGivenUp) {
  SyncPeer peer(world_);
  peer.FallSilentAfter(9);
  AtlasLink link = LinkTo(peer, milliseconds(400));
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  AtlasView view(store, &link);
  const Clock::time_point start = Clock::now();
  MapAround map = Around(view);
  while (map.sync.ok() && Clock::now() - start < std::chrono::seconds(8)) {
    map = Around(view);
  }
  EXPECT_EQ(map.sync.code(), StatusCode::kTimeout) << map.sync.message();
  EXPECT_GE(Clock::now() - start, milliseconds(400));
  EXPECT_FALSE(link.is_connected());
  EXPECT_EQ(store.size(), 4U);
  EXPECT_FALSE(map.tiles.empty());
}

TEST_F(ViewDeadlineTest, AnotherRequestGivesTheRestUp) {
  SyncPeer peer(world_);
  peer.FallSilentAfter(9);
  AtlasLink link = LinkTo(peer, std::chrono::seconds(30));
  AtlasClient& client = **link.Client(std::chrono::seconds(5));
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  SyncQuery query;
  query.area = kEverything;
  query.give_up = kDeadline;
  StoreSyncRest rest;
  const auto part = SyncStore(client, store, query, rest);
  ASSERT_TRUE(part) << part.error().message();
  EXPECT_FALSE(part->is_complete);
  ASSERT_NE(rest.reply, nullptr);

  peer.Release();
  TileStore other = *TileStore::Open(TinyAtlas(), {});
  query.give_up = milliseconds(0);
  const auto whole = SyncStore(client, other, query);
  ASSERT_TRUE(whole) << whole.error().message();
  EXPECT_TRUE(whole->is_complete);
  EXPECT_EQ(other.size(), atlas_tiles_);
  const auto drop = [](const TileBlob&) {
    return Status();
  };
  const auto gone = client.Continue(rest.reply, kDeadline, drop);
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code(), StatusCode::kNotFound);
  EXPECT_EQ(client.Continue(nullptr, kDeadline, drop).error().code(), StatusCode::kNotFound);

  const auto completed = SyncStore(client, store, query, rest);
  ASSERT_TRUE(completed) << completed.error().message();
  EXPECT_TRUE(completed->is_complete);
  EXPECT_EQ(store.size(), atlas_tiles_);
}

TEST_F(ViewDeadlineTest, TheRestMayComeIntoAnotherStore) {
  SyncPeer peer(world_);
  peer.FallSilentAfter(9);
  AtlasLink link = LinkTo(peer, std::chrono::seconds(30));
  AtlasClient& client = **link.Client(std::chrono::seconds(5));
  SyncQuery query;
  query.area = kEverything;
  query.sections = 0b110;
  query.give_up = kDeadline;
  TileStore store = *TileStore::Open(TinyAtlas(), {});
  StoreSyncRest rest;
  ASSERT_TRUE(SyncStore(client, store, query, rest));
  ASSERT_NE(rest.reply, nullptr);
  peer.Release();
  TileStore other = *TileStore::Open(TinyAtlas(), {});
  query.sections = kEverySection;
  query.give_up = milliseconds(0);
  const auto report = SyncStore(client, other, query, rest);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->is_complete);
  EXPECT_EQ(other.size(), atlas_tiles_);
  for (const TileId& id : other.Tiles()) {
    EXPECT_EQ(other.Find(id)->sections, kEverySection) << id.x << ' ' << id.y;
  }
}

}  // namespace
}  // namespace atlas
