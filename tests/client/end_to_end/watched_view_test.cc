// A vehicle's map that asks the real daemon only when there is something to be had.
#include <chrono>
#include <set>

#include "client/vehicle/watched_feed.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience{60'000};
constexpr double kRadius_m = 20.0;

class WatchedViewTest : public VehicleTest {
 protected:
  // Where the drive began.
  static Eigen::Vector2d Place() {
    const QuantizedPose pose = PoseOf(0, 0.0);
    return {static_cast<double>(pose.x_um) * 1e-6, static_cast<double>(pose.y_um) * 1e-6};
  }

  // Calls until nothing is to be asked any more; how often that was.
  static int Settle(AtlasView& view, AtlasClient& client, const Eigen::Vector2d& position_m) {
    for (int call = 1; call < 1'000; ++call) {
      const std::uint64_t sent = client.bytes_sent();
      const auto map = view.Around(position_m, kRadius_m);
      EXPECT_TRUE(map) << map.error().message();
      if (client.bytes_sent() == sent && map->is_current) return call;
    }
    ADD_FAILURE() << "asks again and again";
    return 0;
  }
  static HashById AtlasAround(AtlasClient& client, const Eigen::Vector2d& position_m) {
    HashById tiles;
    RegionQuery query;
    query.disc = {position_m, kRadius_m};
    EXPECT_TRUE(client.QueryRegion(query, [&](const TileBlob& tile) {
      tiles[tile.id] = tile.payload_hash;
      return Status();
    }));
    return tiles;
  }
  // Of those that the daemon has around the place, what the store has.
  static HashById HeldOf(const TileStore& store, const HashById& tiles) {
    HashById held;
    for (const auto& [id, hash] : tiles) {
      const TileFacts* facts = store.Find(id);
      if (facts != nullptr) held[id] = facts->payload_hash;
    }
    return held;
  }
};

TEST_F(WatchedViewTest, AVehicleThatNothingChangesForAsksNothingAndHearsOfAllThatDoes) {
  DaemonProcess daemon(NewData(), kSmall);
  Fill(daemon);
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon.address()));
  AtlasClient& client = **link.Wait(kPatience);
  TileStore store = StoreFor(client);
  WatchedFeed feed(link);
  AtlasView view(store, feed);
  Settle(view, client, Place());
  const std::uint64_t sent = client.bytes_sent();
  const std::uint64_t received = client.bytes_received();
  for (int call = 0; call < 50; ++call) {
    const Eigen::Vector2d further_m = Place() + Eigen::Vector2d(0.5 * call, 0.0);
    const auto map = view.Around(further_m, kRadius_m);
    ASSERT_TRUE(map);
    EXPECT_TRUE(map->is_current);
    EXPECT_FALSE(map->tiles.empty());
  }
  EXPECT_EQ(client.bytes_sent(), sent);
  EXPECT_EQ(client.bytes_received(), received);
  AtlasClient other = Connect(daemon);
  const HashById before = AtlasAround(other, Place());
  ASSERT_EQ(HeldOf(store, before), before);
  ASSERT_EQ(Ingest(daemon, {"--session", "again"}).exit_code, 0);
  ASSERT_TRUE(other.WaitUntilFused(kPatience));
  const HashById after = AtlasAround(other, Place());
  ASSERT_NE(after, before);
  // Told within the interval, however late the view is called.
  bool has_come = false;
  for (int call = 0; call < 5'000 && !has_come; ++call) {
    ASSERT_TRUE(view.Around(Place(), kRadius_m));
    has_come = HeldOf(store, after) == after;
  }
  EXPECT_TRUE(has_come);
  Settle(view, client, Place());
  // Away from what is watched it begins anew.
  const std::uint64_t asked = client.bytes_sent();
  ASSERT_TRUE(view.Around(Place() + Eigen::Vector2d(100.0, 0.0), kRadius_m));
  EXPECT_GT(client.bytes_sent(), asked);
}

TEST_F(WatchedViewTest, WhatTheStoreLostIsAskedForAgain) {
  DaemonProcess daemon(NewData(), kSmall);
  Fill(daemon);
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon.address()));
  AtlasClient& client = **link.Wait(kPatience);
  TileStore store = StoreFor(client);
  WatchedFeed feed(link);
  AtlasView view(store, feed);
  Settle(view, client, Place());
  const std::size_t all = store.size();
  store.Remove(store.Tiles().front());
  const auto map = view.Around(Place(), kRadius_m);
  ASSERT_TRUE(map);
  EXPECT_TRUE(map->is_current);
  EXPECT_EQ(store.size(), all);
}

TEST_F(WatchedViewTest, ALinkThatBreaksIsWatchedAgainAndNothingIsMissed) {
  DaemonProcess daemon(NewData(), kSmall);
  LinkProxy proxy(*Endpoint::Parse(daemon.address()),
                  [calls = 0]() mutable { return calls++ < 3 ? CutAfter(6'000) : LinkPlan(); });
  LinkOptions options;
  options.connection.endpoint = proxy.endpoint();
  options.first_delay = milliseconds(10);
  AtlasLink link(options);
  TileStore store = StoreFor(**link.Wait(kPatience));
  WatchedFeed feed(link);
  AtlasView view(store, feed);
  ASSERT_TRUE(view.Around(Place(), kRadius_m));
  Fill(daemon);
  AtlasClient other = Connect(daemon);
  const HashById now = AtlasAround(other, Place());
  bool has_come = false;
  for (int call = 0; call < 5'000 && !has_come; ++call) {
    const auto map = view.Around(Place(), kRadius_m);
    ASSERT_TRUE(map);
    has_come = map->is_current && HeldOf(store, now) == now;
  }
  EXPECT_TRUE(has_come);
  EXPECT_EQ(proxy.totals().connections, 4U);
  ASSERT_TRUE(link.is_connected());
  Settle(view, **link.Client(kPatience), Place());
}

}  // namespace
}  // namespace atlas
