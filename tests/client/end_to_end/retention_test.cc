// A daemon without room for more, its vehicles, and whoever runs it.
#include <chrono>
#include <csignal>
#include <fstream>

#include "client/vehicle/upload_spool.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/client/end_to_end/vehicle_fixture.h"
#include "tests/core/support/keyframe_worlds.h"
#include "tests/server/http/http_peer.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

class RetentionEndToEndTest : public VehicleTest {
 protected:
  static void Configure(const fs::path& file, const std::string& retention) {
    std::ofstream(file) << "[retention]\n" << retention << "\n[map]\ncell_size = 0.2\n";
  }
  static void Reconfigure(DaemonProcess& daemon,
                          const fs::path& file,
                          const std::string& retention) {
    Configure(file, retention);
    daemon.Signal(SIGHUP);
    ASSERT_NE(daemon.ReadLogUntil("configuration"), "");
  }
  // So many bytes of them; how many that are.
  static std::uint32_t Fill(UploadSpool& spool, const MapProfile& profile, std::uint64_t bytes) {
    const Bytes blob = EncodeKeyframe(testing::StreetKeyframe(profile, 60, 7));
    std::uint32_t i = 0;
    for (; spool.waiting_bytes() < bytes; ++i) {
      KeyframeUpload upload;
      upload.key = {{"car", "monday"}, i};
      upload.time_ms = 1'000 + i;
      upload.T_world_sensor.x_um = 1'000 * std::int64_t{i};
      upload.blob = blob;
      EXPECT_TRUE(spool.Put(upload).ok());
    }
    return i;
  }
  // One call on a connection of its own: the one before may have been told to wait.
  static Result<SpoolReport> Send(const DaemonProcess& daemon, UploadSpool& spool) {
    AtlasClient client = Connect(daemon);
    return spool.Send(client, {.deadline = milliseconds(30'000)});
  }
};

TEST_F(RetentionEndToEndTest, ASpoolKeepsWhatAQuotaRefusedAndSendsItWhenThereIsRoom) {
  const fs::path file = shared_root / "quota.toml";
  Configure(file, "vehicle_mib = 1");
  DaemonProcess daemon(NewData(), {"--config", file.string()}, DaemonProcess::Log::kKept);
  UploadSpool spool = *UploadSpool::Open({.folder = shared_root / "quota_spool"});
  constexpr std::uint64_t kQuota = 1U << 20U;
  AtlasClient client = Connect(daemon);
  const std::uint32_t keyframes = Fill(spool, client.profile(), 2 * kQuota);
  const auto refused = spool.Send(client, {.deadline = milliseconds(30'000)});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.error().reason(), StatusReason::kQuota);
  const auto held_back = spool.Send(client);
  ASSERT_TRUE(held_back);
  EXPECT_GT(held_back->retry_after, milliseconds(5'000)) << "it does not ask again and again";
  EXPECT_EQ(held_back->sent, 0U);
  EXPECT_EQ(Send(daemon, spool).error().reason(), StatusReason::kQuota);

  const auto full = Connect(daemon).ReadStatus();
  EXPECT_LE(full->keyframe_bytes, kQuota);
  EXPECT_GT(full->keyframes, 0U);
  EXPECT_EQ(full->keyframes + spool.waiting(), keyframes) << "one or the other has it";
  EXPECT_EQ(spool.refused(), 0U);

  Reconfigure(daemon, file, "vehicle_mib = 0");
  const auto rest = Send(daemon, spool);
  ASSERT_TRUE(rest) << rest.error().message();
  EXPECT_EQ(spool.waiting(), 0U);
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, keyframes);
}

TEST_F(RetentionEndToEndTest, WhoeverAsksHearsThatTheDiskIsBelowItsFloor) {
  const fs::path file = shared_root / "floor.toml";
  Configure(file, "disk_floor_mib = 16777216");
  DaemonProcess daemon(NewData(), {"--config", file.string(), "--http", "127.0.0.1:0"},
                       DaemonProcess::Log::kKept);
  const CommandRun refused = Ingest(daemon);
  EXPECT_EQ(refused.exit_code, 1);
  const auto error = boost::json::parse(refused.err).at("error");
  EXPECT_EQ(error.at("code").as_string(), "resource_exhausted");
  EXPECT_EQ(error.at("reason").as_string(), "disk_floor");
  const CommandRun status = RunAtlas(daemon.address(), {"status"});
  EXPECT_EQ(status.json().at("refusing").as_string(), "disk_floor");
  EXPECT_EQ(status.Get<std::uint64_t>("disk_floor_bytes"), std::uint64_t{1} << 44U);
  const HttpAnswer ready = AskUntil(daemon.http_port(), "/readyz", 503);
  EXPECT_NE(ready.body.find("retention.disk_floor_mib"), std::string::npos) << ready.body;
  EXPECT_EQ(AskUntil(daemon.http_port(), "/healthz", 200).status, 200);

  Reconfigure(daemon, file, "disk_floor_mib = 0");
  EXPECT_EQ(Ingest(daemon).exit_code, 0);
  EXPECT_EQ(RunAtlas(daemon.address(), {"status"}).json().at("refusing").as_string(), "");
  EXPECT_EQ(AskUntil(daemon.http_port(), "/readyz", 200).status, 200);
}

}  // namespace
}  // namespace atlas
