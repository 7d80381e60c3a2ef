// What looks wrong, with the real daemon: its limits change while it runs.
#include <csignal>
#include <fstream>

#include "client/vehicle/upload_spool.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/client/end_to_end/vehicle_fixture.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas {
namespace {

class QuarantineLimitsTest : public VehicleTest {
 protected:
  static void Configure(const fs::path& file, int max_speed_mps) {
    std::ofstream(file) << "[map]\ncell_size = 0.2\n[quarantine]\nmax_speed_mps = " << max_speed_mps
                        << "\n";
  }
  // A keyframe each 200 m and 100 ms.
  static void Send(AtlasClient& client, const std::string& session, std::uint32_t keyframes) {
    UploadSpool spool = *UploadSpool::Open({.folder = shared_root / ("spool_" + session)});
    const Bytes blob = EncodeKeyframe(testing::StreetKeyframe(client.profile(), 60, 7));
    for (std::uint32_t i = 0; i < keyframes; ++i) {
      KeyframeUpload upload;
      upload.key = {{"car", session}, i};
      upload.time_ms = 1'000 + 100 * i;
      upload.T_world_sensor.x_um = 200'000'000 * std::int64_t{i};
      upload.blob = blob;
      ASSERT_TRUE(spool.Put(upload).ok());
    }
    const auto sent = spool.Send(client);
    ASSERT_TRUE(sent) << sent.error().message();
    EXPECT_EQ(sent->acknowledged, keyframes);
  }
};

TEST_F(QuarantineLimitsTest, CountForWhatComesFromThenOn) {
  const fs::path file = shared_root / "quarantine.toml";
  Configure(file, 90);
  DaemonProcess daemon(NewData(), {"--config", file.string()}, DaemonProcess::Log::kKept);
  AtlasClient client = Connect(daemon);
  Send(client, "monday", 2);
  EXPECT_EQ(client.ReadStatus()->quarantined, 1U);

  Configure(file, 0);
  daemon.Signal(SIGHUP);
  ASSERT_NE(daemon.ReadLogUntil("quarantine.max_speed_mps changed"), "");
  EXPECT_EQ(client.ReadStatus()->quarantined, 1U) << "nothing came of it since";
  Send(client, "tuesday", 2);
  EXPECT_EQ(client.ReadStatus()->quarantined, 1U);
  Send(client, "monday", 3);
  EXPECT_EQ(client.ReadStatus()->quarantined, 1U) << "that is for somebody to decide";

  Configure(file, 90);
  daemon.Signal(SIGHUP);
  ASSERT_NE(daemon.ReadLogUntil("quarantine.max_speed_mps changed"), "");
  Send(client, "wednesday", 2);
  EXPECT_EQ(client.ReadStatus()->quarantined, 2U);
}

}  // namespace
}  // namespace atlas
