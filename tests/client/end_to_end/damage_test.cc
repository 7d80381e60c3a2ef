// Keyframes that are damaged on disk, through the real programs: named, healed by a second ingest,
// or given up by `atlas verify --repair`; `atlas log` tells all of it.
#include <csignal>

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/client/end_to_end/end_to_end_fixture.h"

namespace atlas {
namespace {

class DamageEndToEndTest : public EndToEndTest {
 protected:
  static void Spoil(const fs::path& data) {
    Spoil(data,
          "UPDATE keyframes SET blob = zeroblob(blob_bytes) WHERE id IN "
          "(SELECT id FROM keyframes ORDER BY id LIMIT 2)");
  }
  static void Spoil(const fs::path& data, const char* sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((data / "atlas.db").c_str(), &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10'000);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }
  static std::vector<std::string> Kinds(const DaemonProcess& daemon) {
    const CommandRun log = RunAtlas(daemon.address(), {"log"});
    EXPECT_EQ(log.exit_code, 0) << log.err;
    std::vector<std::string> kinds;
    for (const auto& event : log.json().at("events").as_array()) {
      kinds.emplace_back(event.at("kind").as_string());
    }
    return kinds;
  }
};

TEST_F(DamageEndToEndTest, ASecondIngestHealsAndARepairGivesUp) {
  const fs::path data = NewData();
  std::string intact;
  {
    DaemonProcess daemon(data, kSmall);
    ASSERT_EQ(Ingest(daemon).exit_code, 0);
    intact = Digest(daemon);
    EXPECT_THAT(Kinds(daemon), ::testing::IsEmpty());
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  Spoil(data);
  {
    DaemonProcess daemon(data, {});
    const CommandRun verify = RunAtlas(daemon.address(), {"verify"});
    EXPECT_EQ(verify.exit_code, 6) << verify.err;
    EXPECT_EQ(verify.Get<int>("damaged"), 2);
    EXPECT_THAT(Kinds(daemon), ::testing::ElementsAre("keyframe_damaged", "keyframe_damaged"));
    EXPECT_EQ(Digest(daemon), intact);  // nothing is fused without them
    const CommandRun again = Ingest(daemon);
    EXPECT_EQ(again.exit_code, 0) << again.err;
    EXPECT_EQ(Digest(daemon), intact);
    EXPECT_EQ(RunAtlas(daemon.address(), {"verify", "--rebuild"}).exit_code, 0);
    EXPECT_THAT(Kinds(daemon), ::testing::ElementsAre("keyframe_damaged", "keyframe_damaged",
                                                      "keyframe_healed", "keyframe_healed"));
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  Spoil(data);
  DaemonProcess daemon(data, {});
  const CommandRun repair =
      RunAtlas(daemon.address(), {"verify", "--repair", "--author", "surveyor"});
  EXPECT_EQ(repair.exit_code, 0) << repair.err;
  EXPECT_EQ(repair.Get<int>("given_up"), 2);
  EXPECT_EQ(repair.Get<int>("damaged"), 0);
  EXPECT_NE(Digest(daemon), intact);
  EXPECT_EQ(RunAtlas(daemon.address(), {"verify", "--rebuild"}).exit_code, 0);
  const CommandRun tail = RunAtlas(daemon.address(), {"log", "--after", "4"});
  EXPECT_EQ(tail.json().at("events").as_array().at(0).at("author").as_string(), "surveyor");
  const CommandRun sent = Ingest(daemon);
  EXPECT_EQ(sent.exit_code, 0) << sent.err;
  EXPECT_EQ(Digest(daemon), intact);
}

TEST_F(DamageEndToEndTest, ADamagedLineOfTheLogIsOneOfThemAndHowTheCommandEnds) {
  const fs::path data = NewData();
  DaemonProcess daemon(data, kSmall);
  ASSERT_EQ(Ingest(daemon, {"--session", "first"}).exit_code, 0);
  for (const char* const command : {"retract", "restore", "retract"}) {
    ASSERT_EQ(RunAtlas(daemon.address(), {"session", command, "vehicle/first"}).exit_code, 0);
  }
  Spoil(data, "UPDATE events SET author = x'FF', subject = 'other' WHERE id = 2");
  const CommandRun log = RunAtlas(daemon.address(), {"log"});
  EXPECT_EQ(log.exit_code, 6) << log.out;
  EXPECT_NE(log.err.find("1 of 3 events damaged"), std::string::npos) << log.err;
  const auto& events = log.json().at("events").as_array();
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[1].at("kind").as_string(), "damaged");
  EXPECT_TRUE(events[1].at("damaged").as_bool());
  EXPECT_EQ(events[1].at("id").to_number<int>(), 2);
  EXPECT_EQ(events[2].at("kind").as_string(), "retract");
  EXPECT_EQ(RunAtlas(daemon.address(), {"verify", "--repair"}).exit_code, 0);
  EXPECT_EQ(RunAtlas(daemon.address(), {"log"}).exit_code, 0);
}

TEST_F(DamageEndToEndTest, ADamagedSessionIsOneOfTheListAndHowTheCommandEnds) {
  const fs::path data = NewData();
  {
    DaemonProcess daemon(data, kSmall);
    ASSERT_EQ(Ingest(daemon, {"--session", "first"}).exit_code, 0);
    Spoil(data, "UPDATE sessions SET keyframes = 1 WHERE session = 'first'");
    const CommandRun list = RunAtlas(daemon.address(), {"sessions"});
    EXPECT_EQ(list.exit_code, 6) << list.out;
    EXPECT_NE(list.err.find("1 of 2 damaged"), std::string::npos) << list.err;
    const auto& sessions = list.json().at("sessions").as_array();
    ASSERT_EQ(sessions.size(), 2U);
    EXPECT_EQ(sessions[0].at("state").as_string(), "damaged");
    EXPECT_TRUE(sessions[0].at("damaged").as_bool());
    EXPECT_FALSE(sessions[1].at("damaged").as_bool());
    EXPECT_GT(sessions[1].at("keyframes").to_number<int>(), 1);
  }
  DaemonProcess daemon(data, {});
  EXPECT_EQ(RunAtlas(daemon.address(), {"sessions"}).exit_code, 0);
}

}  // namespace
}  // namespace atlas
