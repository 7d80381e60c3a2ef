// A vehicle with the real daemon: what travels after a correction, after a restart and after a cut.
#include "client/vehicle/upload_spool.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

TEST_F(VehicleTest, AfterACorrectionExactlyTheChangedTilesTravel) {
  DaemonProcess daemon(NewData(), kSmall);
  Fill(daemon);
  AtlasClient client = Connect(daemon);
  TileStore store = StoreFor(client);
  const auto first = SyncStore(client, store, Everywhere());
  ASSERT_TRUE(first) << first.error().message();
  const HashById before = AtlasNow(client);
  EXPECT_EQ(first->tiles, before.size());

  const PoseCorrection correction{{{"vehicle", "overpass"}, 3}, PoseOf(3, 0.4)};
  const auto batch = client.UpdatePoses(std::span(&correction, 1), "test");
  ASSERT_TRUE(batch) << batch.error().message();
  ASSERT_TRUE(client.WaitUntilFused(std::chrono::seconds(60)));
  const HashById after = AtlasNow(client);
  std::uint64_t changed = 0;
  for (const auto& [id, hash] : after) {
    const auto found = before.find(id);
    changed += found == before.end() || found->second != hash ? 1U : 0U;
  }
  ASSERT_GT(changed, 0U);
  ASSERT_LT(changed, after.size());

  const auto second = SyncStore(client, store, Everywhere());
  ASSERT_TRUE(second) << second.error().message();
  EXPECT_TRUE(second->is_complete);
  EXPECT_EQ(second->tiles, changed);
  EXPECT_EQ(Held(store), after);
}

TEST_F(VehicleTest, AWarmStartSendsNotOneTileAgain) {
  const fs::path data = NewData();
  const fs::path kept = shared_root / "kept_tiles";
  HashById held;
  std::size_t tiles = 0;
  const auto drive = [](AtlasView& view) {
    std::uint64_t sent = 0;
    for (double x_m = -20.0; x_m <= 20.0; x_m += 5.0) {
      const auto map = view.Around({x_m, -3.0}, 15.0);
      EXPECT_TRUE(map && map->is_current && map->is_finest_everywhere()) << x_m;
      if (map) sent += map->transfer.tiles;
    }
    return sent;
  };
  {
    DaemonProcess daemon(data, kSmall);
    Fill(daemon);
    TileStore store = StoreFor(Connect(daemon), kept);
    AtlasLink link = LinkTo(*Endpoint::Parse(daemon.address()));
    AtlasView view(store, &link);
    const std::uint64_t sent = drive(view);
    EXPECT_EQ(sent, store.size());
    held = Held(store);
    tiles = store.size();
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  ASSERT_GT(tiles, 10U);
  DaemonProcess restarted(data, {});
  TileStore store = *TileStore::Open(KnownAtlases(kept).at(0), {.folder = kept});
  AtlasLink link = LinkTo(*Endpoint::Parse(restarted.address()));
  AtlasView view(store, &link);
  EXPECT_EQ(drive(view), 0U);
  EXPECT_EQ(Held(store), held);
}

TEST_F(VehicleTest, ACutReplyLeavesAMapAndTheNextSyncCompletesIt) {
  DaemonProcess daemon(NewData(), kSmall);
  Fill(daemon);
  AtlasClient client = Connect(daemon);
  const HashById atlas = AtlasNow(client);
  TileStore store = StoreFor(client);
  std::size_t held = 0;
  for (const std::int64_t bytes : {20'000, 40'000}) {
    LinkProxy proxy(*Endpoint::Parse(daemon.address()), CutAfter(bytes));
    AtlasClient cut = Connect(proxy.endpoint());
    const auto report = SyncStore(cut, store, Everywhere());
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code(), StatusCode::kUnavailable);
    EXPECT_GT(store.size(), held);  // it goes on where it was cut
    held = store.size();
  }
  const auto map = AtlasView(store, nullptr).Around({0.0, -3.0}, 15.0);
  ASSERT_TRUE(map);
  EXPECT_FALSE(map->tiles.empty());
  EXPECT_GT(map->coarse_places, 0U);
  const auto rest = SyncStore(client, store, Everywhere());
  ASSERT_TRUE(rest) << rest.error().message();
  EXPECT_EQ(rest->tiles, atlas.size() - held);
  EXPECT_EQ(Held(store), atlas);
}

TEST_F(VehicleTest, TheHandshakeSaysHowFarASessionIsThere) {
  DaemonProcess daemon(NewData(), kSmall);
  const Endpoint endpoint = *Endpoint::Parse(daemon.address());
  const auto ingest = [&daemon](const std::string& range) {
    return Ingest(daemon, {"--vehicle", "car", "--session", "monday", "--range", range}).exit_code;
  };
  const auto last_sequence = [&endpoint](const std::string& session) {
    ConnectionOptions options;
    options.endpoint = endpoint;
    options.resume = SessionKey{"car", session};
    const auto client = AtlasClient::Connect(options);
    EXPECT_TRUE(client) << client.error().message();
    return client ? client->atlas().last_sequence : std::nullopt;
  };
  const auto listed = [&endpoint] {
    const auto sessions = Connect(endpoint).ListSessions();
    EXPECT_TRUE(sessions && !sessions->empty());
    return sessions && !sessions->empty() ? std::optional(sessions->front().last_sequence)
                                          : std::nullopt;
  };
  EXPECT_EQ(last_sequence("monday"), std::nullopt);
  ASSERT_EQ(ingest("0:10"), 0);
  EXPECT_EQ(last_sequence("monday"), 9U);
  EXPECT_EQ(last_sequence("monday"), listed());
  ASSERT_EQ(ingest("0:20"), 0);
  EXPECT_EQ(last_sequence("monday"), 19U);
  EXPECT_EQ(last_sequence("monday"), listed());
  EXPECT_EQ(last_sequence("tuesday"), std::nullopt);
}

// By way of the disk; what is there keeps the first one, whatever comes later.
TEST_F(VehicleTest, APositionGoesWithItsKeyframeAndStays) {
  DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--vehicle", "car", "--session", "monday", "--range", "0:2"}).exit_code,
            0);
  AtlasClient client = Connect(daemon);
  const auto read = [&client](const std::string& session) {
    std::vector<SessionKeyframe> keyframes;
    const auto reading = client.ReadKeyframes({"car", session}, std::nullopt, [&](auto keyframe) {
      keyframes.push_back(std::move(keyframe));
      return Status();
    });
    EXPECT_TRUE(reading) << reading.error().message();
    return keyframes;
  };
  const std::vector<SessionKeyframe> monday = read("monday");
  ASSERT_EQ(monday.size(), 2U);
  const SpoolOptions options{.folder = shared_root / "spool_of_positions"};
  const KnownPosition first{-3, std::int64_t{1} << 40U, 7, 500};
  std::optional<KnownPosition> prior = first;
  for (const bool is_duplicate : {false, true}) {
    {
      UploadSpool spool = *UploadSpool::Open(options);
      for (const SessionKeyframe& keyframe : monday) {
        KeyframeUpload upload{{{"car", "tuesday"}, keyframe.sequence},
                              keyframe.time_ms,
                              keyframe.T_world_sensor,
                              keyframe.blob};
        upload.prior = keyframe.sequence == monday.front().sequence ? prior : std::nullopt;
        ASSERT_TRUE(spool.Put(upload).ok());
      }
    }
    UploadSpool spool = *UploadSpool::Open(options);
    const auto report = spool.Send(client);
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->acknowledged, 2U) << is_duplicate;
    const std::vector<SessionKeyframe> tuesday = read("tuesday");
    ASSERT_EQ(tuesday.size(), 2U);
    EXPECT_EQ(tuesday[0].prior, first);
    EXPECT_EQ(tuesday[1].prior, std::nullopt);
    prior = KnownPosition{1, 2, 3, 4};
  }
}

TEST_F(VehicleTest, WhatTheDaemonRefusesForGoodIsSetAside) {
  DaemonProcess daemon(NewData(), kSmall);
  UploadSpool spool = *UploadSpool::Open({.folder = shared_root / "spool"});
  const Bytes no_keyframe(100, 7);
  KeyframeUpload upload;
  upload.key = {{"car", "monday"}, 1};
  upload.time_ms = 1'000;
  upload.blob = no_keyframe;
  ASSERT_TRUE(spool.Put(upload).ok());
  AtlasClient client = Connect(daemon);
  const auto report = spool.Send(client);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->set_aside, 1U);
  EXPECT_EQ(spool.waiting(), 0U);
}

}  // namespace
}  // namespace atlas
