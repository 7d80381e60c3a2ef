// A vehicle that began as many sessions as it may, with the real daemon: what it has waits, and its
// map goes on.
#include <chrono>
#include <csignal>
#include <fstream>

#include "client/vehicle/upload_spool.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/client/end_to_end/vehicle_fixture.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas {
namespace {

using std::chrono::minutes;

class SessionLimitTest : public VehicleTest {
 protected:
  // What the daemon may do, in its configuration.
  static void Allow(const fs::path& file, int sessions_per_hour) {
    std::ofstream(file) << "log_format = 'text'\n[map]\ncell_size = 0.2\n[limits]\n"
                        << "sessions_per_hour_per_vehicle = " << sessions_per_hour << "\n";
  }
  // Three keyframes of a session.
  static void Put(UploadSpool& spool, const std::string& session, const MapProfile& profile) {
    const Bytes blob = EncodeKeyframe(testing::StreetKeyframe(profile, 60, 7));
    for (std::uint32_t i = 0; i < 3; ++i) {
      KeyframeUpload upload;
      upload.key = {{"car", session}, i};
      upload.time_ms = 1'000 + i;
      upload.T_world_sensor.x_um = 1'000 * std::int64_t{i};
      upload.blob = blob;
      ASSERT_TRUE(spool.Put(upload).ok());
    }
  }
};

TEST_F(SessionLimitTest, WhatMayNotBeginYetWaitsAndTheMapGoesOn) {
  const fs::path file = shared_root / "session_limit.toml";
  Allow(file, 1);
  DaemonProcess daemon(NewData(), {"--config", file.string()}, DaemonProcess::Log::kKept);
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon.address()));
  AtlasClient& client = **link.Wait(std::chrono::seconds(30));
  UploadSpool spool = *UploadSpool::Open({.folder = shared_root / "limited_spool"});
  Put(spool, "monday", client.profile());
  Put(spool, "tuesday", client.profile());

  const auto first = spool.Send(client);
  ASSERT_FALSE(first);
  EXPECT_EQ(first.error().code(), StatusCode::kUnavailable) << first.error().message();
  ASSERT_TRUE(first.error().retry_after_ms());
  EXPECT_GT(*first.error().retry_after_ms(), 50 * 60'000);
  EXPECT_LE(*first.error().retry_after_ms(), 60 * 60'000);
  EXPECT_EQ(spool.waiting(), 3U);
  const auto again = spool.Send(client);
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_EQ(again->sent, 0U);
  EXPECT_GT(again->retry_after.count(), 0);
  EXPECT_LE(again->retry_after, minutes(1));

  ASSERT_TRUE(client.WaitUntilFused(minutes(1)));
  TileStore store = StoreFor(client);
  const auto map = AtlasView(store, &link).Around({0.0, 0.0}, 5.0);
  ASSERT_TRUE(map);
  EXPECT_TRUE(map->is_current) << map->sync.message();
  EXPECT_FALSE(map->tiles.empty());

  Allow(file, 0);
  daemon.Signal(SIGHUP);
  ASSERT_NE(daemon.ReadLogUntil("sessions_per_hour_per_vehicle changed"), "");
  AtlasClient other = Connect(daemon);
  const auto rest = spool.Send(other);
  ASSERT_TRUE(rest) << rest.error().message();
  EXPECT_EQ(rest->acknowledged, 3U);
  EXPECT_EQ(spool.waiting(), 0U);
  EXPECT_EQ(other.ReadStatus()->keyframes, 6U);
}

}  // namespace
}  // namespace atlas
