// A spool over a link that is slower than its calls, to the real daemon.
#include <algorithm>
#include <chrono>

#include "client/vehicle/upload_spool.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/client/end_to_end/vehicle_fixture.h"
#include "tests/core/support/keyframe_worlds.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::uint32_t kKeyframes = 24;
constexpr milliseconds kDeadline{400};

TEST_F(VehicleTest, ASpoolGoesOnOverAsManyCallsAsASlowLinkTakesAndSendsNothingTwice) {
  DaemonProcess daemon(NewData(), kSmall);
  LinkPlan slow;
  slow.pace.bits_per_s = 256'000;
  LinkProxy proxy(*Endpoint::Parse(daemon.address()), slow);
  AtlasClient client = Connect(proxy.endpoint());
  UploadSpool spool = *UploadSpool::Open({.folder = shared_root / "slow_spool"});
  const Bytes blob = EncodeKeyframe(testing::StreetKeyframe(client.profile(), 60, 7));
  for (std::uint32_t i = 0; i < kKeyframes; ++i) {
    KeyframeUpload upload;
    upload.key = {{"car", "monday"}, i};
    upload.time_ms = 1'000 + i;
    upload.T_world_sensor.x_um = 1'000 * std::int64_t{i};
    upload.blob = blob;
    ASSERT_TRUE(spool.Put(upload).ok());
  }
  SpoolReport all;
  int calls = 0;
  milliseconds longest{0};
  for (; calls < 500 && spool.waiting() > 0; ++calls) {
    const Clock::time_point start = Clock::now();
    const auto report = spool.Send(client, {.deadline = kDeadline});
    longest = std::max(longest, std::chrono::ceil<milliseconds>(Clock::now() - start));
    ASSERT_TRUE(report) << report.error().message();
    EXPECT_EQ(report->waiting, spool.waiting());
    all.sent += report->sent;
    all.acknowledged += report->acknowledged;
  }
  RecordProperty("longest_ms", static_cast<int>(longest.count()));
  EXPECT_LT(longest, kDeadline + testing::Slack(600));
  EXPECT_GT(calls, 3);
  EXPECT_EQ(all.sent, kKeyframes);
  EXPECT_EQ(all.acknowledged, kKeyframes);
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, kKeyframes);
  EXPECT_EQ(proxy.totals().connections, 1U);
}

}  // namespace
}  // namespace atlas
