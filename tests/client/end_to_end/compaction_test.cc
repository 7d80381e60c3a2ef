// A road driven again and again: old passes are dropped through the real programs, and whoever
// looks at the map, sends again, or pulls the plug sees nothing of it.
#include <chrono>
#include <csignal>
#include <future>

#include "tests/client/end_to_end/end_to_end_fixture.h"

namespace atlas {
namespace {

constexpr int kPasses = 5;

class CompactionEndToEndTest : public EndToEndTest {
 protected:
  static std::vector<std::string> Bounded() {
    return {"--cell-size", "0.2", "--preset", "bounded", "--workers", "2"};
  }
  // The drive of the fixture, sent as another session, 1,000 s later each time.
  static CommandRun IngestPass(const DaemonProcess& daemon, int pass) {
    return Ingest(daemon, {"--session", "pass" + std::to_string(pass), "--start",
                           std::to_string(1'000 * pass)});
  }
  static std::uint64_t IngestPasses(const DaemonProcess& daemon) {
    std::uint64_t keyframes = 0;
    for (int pass = 0; pass < kPasses; ++pass) {
      const CommandRun run = IngestPass(daemon, pass);
      EXPECT_EQ(run.exit_code, 0) << run.err;
      keyframes = run.Get<std::uint64_t>("keyframes");
    }
    return keyframes;
  }
  static CommandRun Compact(const DaemonProcess& daemon, const std::string& before = "1e6") {
    return RunAtlas(daemon.address(), {"compact", "--before", before});
  }
  static void ExpectSound(const DaemonProcess& daemon) {
    const CommandRun verify = RunAtlas(daemon.address(), {"verify", "--rebuild"});
    EXPECT_EQ(verify.exit_code, 0) << verify.err;
  }
};

TEST_F(CompactionEndToEndTest, OldPassesGoAndTheMapStays) {
  const fs::path data = NewData();
  std::string digest;
  std::uint64_t horizon = 0;
  {
    DaemonProcess daemon(data, Bounded());
    const std::uint64_t keyframes = IngestPasses(daemon);
    digest = Digest(daemon);
    const CommandRun none = Compact(daemon, "0");
    ASSERT_EQ(none.exit_code, 0) << none.err;
    EXPECT_EQ(none.Get<int>("dropped"), 0);
    EXPECT_EQ(none.Get<int>("horizon"), 0);
    const CommandRun done = Compact(daemon);
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(done.Get<std::uint64_t>("dropped"), (kPasses - 3) * keyframes);
    EXPECT_GT(done.Get<std::uint64_t>("bytes"), 1'000u);
    EXPECT_GT(done.Get<std::uint64_t>("tiles_checked"), 0u);
    horizon = done.Get<std::uint64_t>("horizon");
    EXPECT_EQ(horizon, done.Get<std::uint64_t>("revision"));
    EXPECT_EQ(Digest(daemon), digest);
    EXPECT_EQ(Compact(daemon).Get<int>("dropped"), 0);
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  DaemonProcess daemon(data, {});
  EXPECT_EQ(Digest(daemon), digest);
  ExpectSound(daemon);
  const CommandRun again = IngestPass(daemon, 0);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.Get<int>("duplicates"), again.Get<int>("keyframes"));
  const CommandRun status = RunAtlas(daemon.address(), {"status"});
  EXPECT_EQ(status.Get<int>("compacted"), (kPasses - 3) * again.Get<int>("keyframes"));
  EXPECT_EQ(status.Get<int>("keyframes"), 3 * again.Get<int>("keyframes"));
  const CommandRun listed = RunAtlas(daemon.address(), {"sessions"});
  const auto& first = listed.json().at("sessions").as_array().at(0);
  EXPECT_EQ(first.at("session").as_string(), "pass0");
  EXPECT_EQ(first.at("state").as_string(), "live");
  EXPECT_EQ(first.at("keyframes").to_number<int>(), 0);
  EXPECT_GT(first.at("compacted").to_number<int>(), 0);
  const std::string before = std::to_string(horizon - 1);
  for (const std::vector<std::string>& look :
       {std::vector<std::string>{"digest", "--at", before},
        {"point", "0", "-3", "--at", before},
        {"query", "--center", "0,0", "--radius", "9", "--at", before}}) {
    const CommandRun gone = RunAtlas(daemon.address(), look);
    EXPECT_EQ(gone.exit_code, 3) << look[0];
    EXPECT_NE(gone.err.find("no longer kept"), std::string::npos) << gone.err;
  }
  EXPECT_EQ(RunAtlas(daemon.address(), {"digest", "--at", std::to_string(horizon)})
                .json()
                .at("digest")
                .as_string(),
            digest);
  const CommandRun retract = RunAtlas(daemon.address(), {"session", "retract", "vehicle/pass4"});
  EXPECT_EQ(retract.exit_code, 0) << retract.err;
  EXPECT_NE(Digest(daemon), digest);
  ExpectSound(daemon);
}

TEST_F(CompactionEndToEndTest, OtherPresetsAreRefused) {
  DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  const CommandRun refused = Compact(daemon);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("expected bounded"), std::string::npos) << refused.err;
  EXPECT_EQ(Compact(daemon, "-1").exit_code, 2);
}

// Whenever it is killed, all of it happened or nothing.
TEST_F(CompactionEndToEndTest, AKilledDaemonComesBackWithTheSameMap) {
  const fs::path data = NewData();
  std::string digest;
  std::uint64_t keyframes = 0;
  {
    DaemonProcess daemon(data, Bounded());
    keyframes = kPasses * IngestPasses(daemon);
    digest = Digest(daemon);
  }
  for (const int after_ms : {1, 30, 100, 250, 500, 800}) {
    {
      DaemonProcess daemon(data, {});
      auto compaction = std::async(std::launch::async, [&] { return Compact(daemon); });
      compaction.wait_for(std::chrono::milliseconds(after_ms));
      daemon.Stop(SIGKILL);
      const int exit_code = compaction.get().exit_code;
      EXPECT_TRUE(exit_code == 0 || exit_code == 5) << exit_code;
    }
    DaemonProcess daemon(data, {});
    EXPECT_EQ(Digest(daemon), digest);
    const CommandRun status = RunAtlas(daemon.address(), {"status"});
    const auto compacted = status.Get<std::uint64_t>("compacted");
    EXPECT_EQ(status.Get<std::uint64_t>("keyframes") + compacted, keyframes);
    EXPECT_TRUE(compacted == 0 || compacted == keyframes / kPasses * (kPasses - 3)) << compacted;
  }
  DaemonProcess daemon(data, {});
  EXPECT_EQ(Compact(daemon).exit_code, 0);
  EXPECT_EQ(Digest(daemon), digest);
  ExpectSound(daemon);
}

}  // namespace
}  // namespace atlas
