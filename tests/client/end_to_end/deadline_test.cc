// Calls that are given up all the time, with a real daemon, in the clear and over TLS: what was on
// its way comes with the next one, each tile once.
#include <gtest/gtest.h>

#include "tests/client/end_to_end/vehicle_fixture.h"
#include "tests/core/support/test_scale.h"
#include "tests/server/net/test_certificates.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

class DeadlineTest : public VehicleTest {
 protected:
  // Each tile of the atlas into a new store, in calls of a millisecond.
  static void FollowInGlimpses(AtlasClient& client, const HashById& atlas, int& rests) {
    TileStore store = StoreFor(client);
    SyncQuery query = Everywhere();
    query.give_up = milliseconds(1);
    StoreSyncRest rest;
    std::uint64_t tiles = 0;
    std::uint64_t bytes = 0;
    const std::uint64_t before = client.bytes_received();
    bool is_complete = false;
    for (int call = 0; call < 20'000 && !is_complete; ++call) {
      const auto report = SyncStore(client, store, query, rest);
      ASSERT_TRUE(report) << report.error().message();
      tiles += report->tiles;
      bytes += report->bytes;
      rests += rest.reply != nullptr ? 1 : 0;
      is_complete = report->is_complete;
    }
    EXPECT_TRUE(is_complete);
    EXPECT_EQ(Held(store), atlas);
    EXPECT_EQ(tiles, atlas.size());
    EXPECT_EQ(bytes, client.bytes_received() - before);
  }
};

TEST_F(DeadlineTest, CallsThatAreGivenUpAddUpToTheAtlas) {
  const fs::path data = NewData();
  const std::uint32_t stores = testing::Scaled(20);
  HashById atlas;
  int rests = 0;
  {
    DaemonProcess daemon(data, kSmall);
    Fill(daemon);
    AtlasClient client = Connect(daemon);
    atlas = AtlasNow(client);
    ASSERT_GT(atlas.size(), 10U);
    for (std::uint32_t store = 0; store < stores; ++store) {
      FollowInGlimpses(client, atlas, rests);
    }
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  EXPECT_GT(rests, 0) << "nothing was given up";

  const fs::path certificates = shared_root / "deadline_certificates";
  fs::create_directories(certificates);
  const TestAuthority authority(certificates, "test authority");
  const CertificateFiles files = authority.Issue("localhost");
  DaemonProcess daemon(
      data, {"--tls-certificate", files.certificate.string(), "--tls-key", files.key.string()});
  ConnectionOptions options;
  options.endpoint = *Endpoint::Parse(daemon.address());
  options.tls = ConnectionTls{authority.certificate(), {}, {}, "localhost"};
  // Where another program has the core meanwhile, one call finds all that it waits for: not always.
  int calls = 0;
  ConnectProgress progress;
  for (int connection = 0; connection < 100 && calls <= 3; ++connection) {
    ConnectAttempt attempt(options);
    progress = {};
    for (calls = 0; !progress.client && progress.failure.ok(); ++calls) {
      progress = attempt.Continue(milliseconds(0));
    }
    ASSERT_TRUE(progress.client) << progress.failure.message();
  }
  EXPECT_GT(calls, 3) << "TCP, TLS and the handshake, each in a call of its own at least";
  rests = 0;
  for (std::uint32_t store = 0; store < stores; ++store) {
    FollowInGlimpses(*progress.client, atlas, rests);
  }
  EXPECT_GT(rests, 0) << "nothing was given up";
}

}  // namespace
}  // namespace atlas
