// `atlas ingest --staged` and `atlas session publish` with the real daemon.
#include <algorithm>

#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

class StagedIngestTest : public VehicleTest {
 protected:
  static std::string StateOf(const DaemonProcess& daemon, const std::string& session) {
    const auto sessions = Connect(daemon).ListSessions();
    const auto found =
        std::find_if(sessions->begin(), sessions->end(),
                     [&](const SessionSummary& s) { return s.key.session == session; });
    return found == sessions->end() ? "" : found->state;
  }
  static CommandRun Publish(const DaemonProcess& daemon, const std::string& session) {
    return RunAtlas(daemon.address(), {"session", "publish", "vehicle/" + session, "--author",
                                       "alice", "--reason", "looked at"});
  }
};

TEST_F(StagedIngestTest, APublishedDriveIsTheOneThatWasIngestedLive) {
  const DaemonProcess live(NewData(), kSmall);
  ASSERT_EQ(Ingest(live).exit_code, 0);
  const DaemonProcess daemon(NewData(), kSmall);
  const std::string empty = Digest(daemon);
  const CommandRun staged = Ingest(daemon, {"--staged"});
  ASSERT_EQ(staged.exit_code, 0) << staged.err;
  EXPECT_NE(staged.err.find("session vehicle/overpass is staged, not in the map"),
            std::string::npos)
      << staged.err;
  EXPECT_EQ(Digest(daemon), empty);
  EXPECT_EQ(StateOf(daemon, "overpass"), "staged");
  EXPECT_EQ(StateOf(daemon, "overpass.2"), "staged") << "every part of the drive is";
  ASSERT_EQ(Publish(daemon, "overpass").exit_code, 0);
  EXPECT_NE(Digest(daemon), Digest(live)) << "one of two parts";
  const CommandRun published = Publish(daemon, "overpass.2");
  EXPECT_TRUE(published.json().at("changed").as_bool());
  EXPECT_EQ(published.json().at("state").as_string(), "live");
  EXPECT_FALSE(Publish(daemon, "overpass.2").json().at("changed").as_bool());
  EXPECT_EQ(Digest(daemon), Digest(live));
  const CommandRun log = RunAtlas(daemon.address(), {"log"});
  EXPECT_NE(log.out.find("\"session_published\",\"author\":\"alice\""), std::string::npos)
      << log.out;
}

TEST_F(StagedIngestTest, AnInterruptedOneGoesOnStagedWithOrWithoutTheFlag) {
  const DaemonProcess daemon(NewData(), kSmall);
  const std::string empty = Digest(daemon);
  ASSERT_EQ(Ingest(daemon, {"--staged", "--range", "0:5"}).exit_code, 0);
  ASSERT_EQ(Ingest(daemon, {"--staged", "--range", "0:9"}).exit_code, 0);
  const CommandRun rest = Ingest(daemon, {"--range", "0:12"});
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, 12U);
  EXPECT_EQ(Digest(daemon), empty);
}

TEST_F(StagedIngestTest, NothingGoesIntoTheMapThatWasToBeStaged) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--range", "0:5"}).exit_code, 0);
  const CommandRun run = Ingest(daemon, {"--staged", "--range", "0:9"});
  EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kConflict));
  EXPECT_NE(run.err.find("session vehicle/overpass is there already, and live"), std::string::npos)
      << run.err;
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, 5U);
  EXPECT_EQ(Ingest(daemon, {"--staged", "--session", "other", "--range", "0:3"}).exit_code, 0);
}

TEST_F(StagedIngestTest, ASessionThatWasRetractedIsRestoredFirst) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--staged", "--range", "0:3"}).exit_code, 0);
  const auto change = [&](const std::string& word) {
    return RunAtlas(daemon.address(), {"session", word, "vehicle/overpass"});
  };
  EXPECT_EQ(change("release").exit_code, static_cast<int>(ExitCode::kConflict));
  ASSERT_EQ(change("retract").exit_code, 0);
  const CommandRun refused = Publish(daemon, "overpass");
  EXPECT_EQ(refused.exit_code, static_cast<int>(ExitCode::kConflict));
  EXPECT_NE(refused.err.find("restore it first"), std::string::npos) << refused.err;
  EXPECT_EQ(change("restore").json().at("state").as_string(), "staged");
  EXPECT_EQ(Publish(daemon, "overpass").json().at("state").as_string(), "live");
}

}  // namespace
}  // namespace atlas
