// Vehicles that are told what changes by the real daemon.
#include <chrono>
#include <functional>
#include <future>
#include <string>
#include <vector>

#include "client/connection/atlas_watch.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPatience{60'000};

class WatchTest : public VehicleTest {
 protected:
  static WatchQuery Anywhere() {
    WatchQuery query;
    query.area = DiscArea{{0.0, 0.0}, 1e6};
    return query;
  }
  static AtlasWatch Watch(AtlasClient& client) {
    auto watch = client.Watch(Anywhere(), kPatience);
    if (!watch) throw std::runtime_error(watch.error().message());
    const auto first = watch->Next(kPatience);
    if (!first || !*first) throw std::runtime_error("no first event");
    return *std::move(watch);
  }
  static void RetractAll(AtlasClient& client) {
    const auto sessions = client.ListSessions();
    ASSERT_TRUE(sessions);
    for (const SessionSummary& session : *sessions) {
      ASSERT_TRUE(client.ChangeSession(session.key, SessionAction::kRetract, "me"));
    }
    ASSERT_TRUE(client.WaitUntilFused(kPatience));
  }
  // Until what was told is all that is expected.
  static AreaChanges AllOf(AtlasWatch& watch,
                           const std::function<bool(const AreaChanges&)>& is_all) {
    AreaChanges all;
    while (!is_all(all)) {
      const auto changes = watch.Next(kPatience);
      if (!changes || !*changes) throw std::runtime_error("not all was told");
      all.Add(**changes);
    }
    return all;
  }
};

TEST_F(WatchTest, TellsEveryTileThatCameAndASyncBesideItGetsThem) {
  DaemonProcess daemon(NewData(), kSmall);
  AtlasClient client = Connect(daemon);
  TileStore store = StoreFor(client);
  AtlasWatch watch = Watch(client);
  ASSERT_TRUE(SyncStore(client, store, Everywhere()));
  EXPECT_EQ(store.size(), 0U);
  Fill(daemon);
  AtlasClient other = Connect(daemon);
  const HashById now = AtlasNow(other);
  const AreaChanges all =
      AllOf(watch, [&now](const AreaChanges& told) { return told.changed.size() >= now.size(); });
  EXPECT_FALSE(all.is_anything);
  EXPECT_EQ(all.changed.size(), now.size());
  for (const auto& [id, revision] : all.changed) {
    EXPECT_TRUE(now.contains(id)) << id;
  }
  ASSERT_TRUE(SyncStore(client, store, Everywhere()));
  EXPECT_EQ(Held(store), now);
  RetractAll(other);
  const AreaChanges gone =
      AllOf(watch, [&now](const AreaChanges& told) { return told.removed.size() >= now.size(); });
  EXPECT_EQ(gone.removed.size(), now.size());
  EXPECT_TRUE(gone.changed.empty());
}

// Nobody fetches while all of the atlas comes and goes again.
TEST_F(WatchTest, ASlowWatcherIsToldEachTileOnceAsItIsNow) {
  DaemonProcess daemon(NewData(), kSmall);
  AtlasClient client = Connect(daemon);
  AtlasWatch watch = Watch(client);
  Fill(daemon);
  AtlasClient other = Connect(daemon);
  const HashById there = AtlasNow(other);
  RetractAll(other);
  ASSERT_TRUE(client.ReadStatus());  // reads what was told so far
  const AreaChanges all = AllOf(
      watch, [&there](const AreaChanges& told) { return told.removed.size() >= there.size(); });
  EXPECT_TRUE(all.changed.empty());
  EXPECT_EQ(all.removed.size(), there.size());
}

TEST_F(WatchTest, TooManyAreATypedEndAndThoseThatWentMakeRoom) {
  DaemonProcess daemon(NewData(), kSmall);
  AtlasClient client = Connect(daemon);
  for (int round = 0; round < 3; ++round) {
    std::vector<AtlasWatch> watches;
    for (int i = 0; i < 16; ++i) {
      watches.push_back(Watch(client));
    }
    auto more = client.Watch(Anywhere(), kPatience);
    ASSERT_TRUE(more);
    const auto refused = more->Next(kPatience);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(refused.error(), more->end());
    EXPECT_FALSE(client.is_broken());
    watches.clear();
    // Behind their ends: a watch counts until the daemon has ended it.
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(client.ReadStatus());
    }
  }
}

TEST_F(WatchTest, ALinkThatBreaksEndsItAndTheNextConnectionSyncsWhatWasMissed) {
  DaemonProcess daemon(NewData(), kSmall);
  const Endpoint endpoint = *Endpoint::Parse(daemon.address());
  LinkProxy proxy(endpoint, CutAfter(3'000));
  AtlasClient broken = Connect(proxy.endpoint());
  TileStore store = StoreFor(broken);
  AtlasWatch watch = Watch(broken);
  Fill(daemon);
  Result<std::optional<AreaChanges>> changes = std::nullopt;
  for (int i = 0; i < 1'000 && changes; ++i) {
    changes = watch.Next(milliseconds(100));
    if (!broken.ReadStatus()) break;
  }
  EXPECT_TRUE(broken.is_broken());
  EXPECT_EQ(watch.Next(kPatience).error().code(), StatusCode::kUnavailable);
  AtlasClient again = Connect(endpoint);
  watch = Watch(again);
  ASSERT_TRUE(SyncStore(again, store, Everywhere()));
  EXPECT_EQ(Held(store), AtlasNow(again));
  ASSERT_EQ(Ingest(daemon, {"--session", "again"}).exit_code, 0);
  const auto next = watch.Next(kPatience);
  ASSERT_TRUE(next && *next) << "the new watch tells";
}

TEST_F(WatchTest, TheCommandTellsALineATile) {
  DaemonProcess daemon(NewData(), kSmall);
  const auto began = std::chrono::steady_clock::now();
  Fill(daemon);
  const std::chrono::duration<double> filling = std::chrono::steady_clock::now() - began;
  // Long enough for some drives, however slow this build is.
  const std::string seconds = std::to_string(2.0 + 4.0 * filling.count());
  auto watched = std::async(std::launch::async, [&daemon, &seconds] {
    return RunAtlas(daemon.address(), {"watch", "--center", "0,0", "--radius", "1000", "--level",
                                       "1", "--interval", "0.1", "--for", seconds});
  });
  // The whole time, for it begins at its own.
  for (int drive = 0; watched.wait_for(milliseconds(0)) != std::future_status::ready; ++drive) {
    ASSERT_EQ(Ingest(daemon, {"--session", "drive" + std::to_string(drive)}).exit_code, 0);
  }
  const CommandRun run = watched.get();
  ASSERT_EQ(run.exit_code, 0) << run.err;
  ASSERT_GT(run.lines.size(), 1U);
  EXPECT_EQ(run.lines.front().at("type"), "begin");
  EXPECT_GT(run.lines.front().at("revision").to_number<int>(), 0);
  AtlasClient client = Connect(daemon);
  ASSERT_TRUE(client.WaitUntilFused(kPatience));
  const HashById now = AtlasNow(client);
  for (std::size_t i = 1; i < run.lines.size(); ++i) {
    const boost::json::value& line = run.lines[i];
    EXPECT_EQ(line.at("type"), "changed");
    EXPECT_GE(line.at("level").to_number<int>(), 1);
    const TileId id{line.at("level").to_number<std::uint8_t>(), line.at("x").to_number<int>(),
                    line.at("y").to_number<int>()};
    EXPECT_TRUE(now.contains(id)) << id;
  }
}

// An answer to the request is no failure of the link: nothing connects again.
TEST_F(WatchTest, WhatTheDaemonDoesNotFinishInTimeLeavesTheLink) {
  DaemonProcess daemon(NewData(), kSmall);
  Fill(daemon);
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon.address()));
  const auto client = link.Wait(kPatience);
  ASSERT_TRUE(client);
  const std::uint64_t revision = (*client)->atlas().revision;
  const auto digest = (*client)->Digest(milliseconds(0), revision);
  ASSERT_FALSE(digest);
  EXPECT_EQ(digest.error().code(), StatusCode::kTimeout);
  link.Report(digest.error());
  ASSERT_TRUE(link.is_connected()) << "else the client is gone";
  EXPECT_TRUE((*client)->ReadStatus());
}

}  // namespace
}  // namespace atlas
