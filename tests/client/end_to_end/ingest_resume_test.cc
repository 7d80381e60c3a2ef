// `atlas ingest` over a link that breaks, and after a run that was interrupted.
#include <array>
#include <atomic>
#include <map>
#include <memory>
#include <thread>
#include <utility>

#include "client/drive/drive_ingest.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

class IngestResumeTest : public VehicleTest {
 protected:
  static CommandRun IngestOver(const Endpoint& endpoint, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {
        "ingest", shared_drive.string(), "--max-range", "12", "--every", "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunAtlas(endpoint.ToText(), arguments);
  }
  // One keyframe after the other.
  static IngestOptions OverpassOptions(milliseconds patience) {
    IngestOptions options;
    options.session = {"vehicle", "overpass"};
    options.max_range_m = 12.0;
    options.now_s = 1e9;
    options.upload.max_in_flight = 1;
    options.upload.patience = patience;
    return options;
  }
  static std::string DigestOfCleanRun() {
    const DaemonProcess daemon(NewData(), kSmall);
    EXPECT_EQ(Ingest(daemon).exit_code, 0);
    return Digest(daemon);
  }
};

TEST_F(IngestResumeTest, AConnectionThatBreaksInTheMiddleIsMadeAgain) {
  const std::string clean = DigestOfCleanRun();
  for (const LinkCut::Kind kind : {LinkCut::Kind::kClose, LinkCut::Kind::kReset}) {
    const DaemonProcess daemon(NewData(), kSmall);
    std::atomic<int> connections = 0;
    // Two connections carry a part of it, one in the middle nothing at all.
    LinkProxy proxy(*Endpoint::Parse(daemon.address()), [&connections, kind] {
      const int number = connections++;
      if (number > 2) return LinkPlan{};
      return LinkPlan{.up = {.after_bytes = number == 1 ? 1 : 200'000, .kind = kind},
                      .refused_after = milliseconds(50)};
    });
    const CommandRun run = IngestOver(proxy.endpoint(), {"--batch", "4"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.Get<int>("reconnections"), 2);
    EXPECT_EQ(run.Get<int>("sent_before"), 0);
    EXPECT_LE(run.Get<int>("duplicates"), 8) << "what was on its way twice";
    EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, run.Get<std::uint64_t>("keyframes"));
    EXPECT_EQ(Digest(daemon), clean);
  }
}

TEST_F(IngestResumeTest, ALinkThatBreaksOnceAllIsThereIsMadeAgainForTheLastQuestion) {
  std::int64_t bytes_up = 0;
  {
    const DaemonProcess daemon(NewData(), kSmall);
    LinkProxy proxy(*Endpoint::Parse(daemon.address()), LinkPlan{});
    ASSERT_EQ(IngestOver(proxy.endpoint(), {"--range", "0:3"}).exit_code, 0);
    bytes_up = static_cast<std::int64_t>(proxy.totals().bytes_up);
  }
  const DaemonProcess daemon(NewData(), kSmall);
  std::atomic<int> connections = 0;
  LinkProxy proxy(*Endpoint::Parse(daemon.address()), [&connections, bytes_up] {
    // Within the question what the sessions hold, which is the last.
    return connections++ == 0 ? LinkPlan{.up = {.after_bytes = bytes_up - 10}} : LinkPlan{};
  });
  const CommandRun run = IngestOver(proxy.endpoint(), {"--range", "0:3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.Get<int>("reconnections"), 1);
  EXPECT_EQ(run.Get<int>("acked"), 3);
  EXPECT_EQ(run.Get<int>("duplicates"), 0) << "nothing was sent again";
}

TEST_F(IngestResumeTest, ADaemonThatIsStartedAgainGetsTheRest) {
  const fs::path data = NewData();
  auto daemon = std::make_unique<DaemonProcess>(data, kSmall);
  const Endpoint address = *Endpoint::Parse(daemon->address());
  const IngestOptions options = OverpassOptions(std::chrono::seconds(30));
  bool is_restarted = false;  // what was on its way is sent, and told, once more
  const auto restart = [&](std::size_t done, std::size_t) {
    if (done != 10 || std::exchange(is_restarted, true)) return;
    daemon.reset();  // by SIGKILL
    daemon.reset(new DaemonProcess(DaemonProcess::Begin(data, address.ToText(), kSmall)));
    ASSERT_EQ(daemon->AwaitListening(), "listening " + address.ToText());
  };
  AtlasLink link = LinkTo(address);
  const auto drive = OpenDriveFolder(shared_drive.string());
  const auto report = IngestDrive(*drive, options, link, restart);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->upload.reconnections, 1U);
  EXPECT_EQ(Connect(*daemon).ReadStatus()->keyframes, report->keyframes);
  EXPECT_EQ(Digest(*daemon), DigestOfCleanRun());
}

TEST_F(IngestResumeTest, ALinkThatStaysBrokenEndsTheRunWithWhereItWas) {
  const DaemonProcess daemon(NewData(), kSmall);
  LinkProxy proxy(*Endpoint::Parse(daemon.address()),
                  LinkPlan{.up = {.after_bytes = 200'000}, .refused_after = std::chrono::hours(1)});
  const IngestOptions options = OverpassOptions(milliseconds(300));
  AtlasLink link = LinkTo(proxy.endpoint());
  const auto drive = OpenDriveFolder(shared_drive.string());
  const auto report = IngestDrive(*drive, options, link, {});
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code(), StatusCode::kUnavailable);
  EXPECT_NE(report.error().message().find("keyframe vehicle/overpass"), std::string::npos)
      << report.error().message();
  EXPECT_NE(report.error().message().find("the same command goes on there"), std::string::npos);
}

TEST_F(IngestResumeTest, ASecondRunSendsWhatTheFirstDidNot) {
  const std::string clean = DigestOfCleanRun();
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--range", "0:30"}).exit_code, 0);  // as if it was interrupted there
  const CommandRun whole = Ingest(daemon);
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_EQ(whole.Get<std::size_t>("sent_before"), 30 - kSentTwice);
  EXPECT_EQ(whole.Get<std::size_t>("duplicates"), kSentTwice);
  EXPECT_EQ(whole.Get<std::size_t>("acked"), whole.Get<std::size_t>("keyframes") - 30 + kSentTwice);
  EXPECT_EQ(Digest(daemon), clean);
  const CommandRun again = Ingest(daemon);
  EXPECT_EQ(again.Get<int>("duplicates"), again.Get<int>("keyframes")) << "all of it, as a check";
}

TEST_F(IngestResumeTest, OtherOptionsThanTheFirstRunsAreAConflict) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--range", "0:30"}).exit_code, 0);
  const std::string first = Digest(daemon);
  const CommandRun other = Ingest(daemon, {"--rings", "8"});
  EXPECT_EQ(other.exit_code, static_cast<int>(ExitCode::kConflict)) << other.err;
  EXPECT_NE(other.err.find("with other content"), std::string::npos) << other.err;
  EXPECT_NE(other.err.find("(--sensor-height)"), std::string::npos) << other.err;
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, 30U) << "none of them was stored";
  EXPECT_EQ(Digest(daemon), first);
  EXPECT_EQ(Ingest(daemon).exit_code, 0) << "the right command goes on";
}

TEST_F(IngestResumeTest, AnotherDriveUnderTheSameNameStoresNothing) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--range", "0:5"}).exit_code, 0);
  const CommandRun later = Ingest(daemon, {"--start", "1"});  // no time is what it was
  EXPECT_EQ(later.exit_code, static_cast<int>(ExitCode::kConflict)) << later.err;
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, 5U);
  EXPECT_EQ(Ingest(daemon).exit_code, 0) << "the right command goes on";
}

TEST_F(IngestResumeTest, NorDoesOneOfOtherNumbers) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--scans", "even", "--range", "0:31"}).exit_code, 0);
  const std::string first = Digest(daemon);
  // It has no keyframe 30; before that there is room for its odd ones.
  const CommandRun other = Ingest(daemon, {"--rings", "8", "--range", "0:30"});
  EXPECT_EQ(other.exit_code, static_cast<int>(ExitCode::kConflict)) << other.err;
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, 16U);
  EXPECT_EQ(Digest(daemon), first);
}

TEST_F(IngestResumeTest, WhatIsThereBesidesAndWhatIsNotInTheMapIsTold) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--scans", "odd", "--range", "0:10"}).exit_code, 0);
  // Another drive whose numbers lie between: nobody can know until one is met.
  const CommandRun other = Ingest(daemon, {"--rings", "8", "--range", "0:4"});
  EXPECT_EQ(other.exit_code, static_cast<int>(ExitCode::kConflict)) << other.err;
  // The first one, and what was on its way when the second was refused.
  const auto stored = std::to_string(Connect(daemon).ReadStatus()->keyframes - 5);
  EXPECT_NE(other.err.find("before it " + stored + " keyframes of this run"), std::string::npos)
      << other.err;
  const CommandRun right = Ingest(daemon, {"--scans", "odd", "--range", "0:10"});
  EXPECT_EQ(right.exit_code, 0) << right.err;
  EXPECT_NE(right.err.find("vehicle/overpass has " + stored + " keyframes more"), std::string::npos)
      << right.err;
  ASSERT_EQ(RunAtlas(daemon.address(), {"session", "retract", "vehicle/overpass"}).exit_code, 0);
  const CommandRun again = Ingest(daemon, {"--scans", "odd", "--range", "0:10"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.err.find("is retracted, not in the map"), std::string::npos) << again.err;
  const auto& states = again.json().at("session_states").as_array();
  ASSERT_EQ(states.size(), 1U);
  EXPECT_EQ(states[0].at("session"), "overpass");
  EXPECT_EQ(states[0].at("state"), "retracted");
  EXPECT_EQ(states[0].at("in_map"), false);
  EXPECT_EQ(std::to_string(states[0].at("others").to_number<int>()), stored);
}

TEST_F(IngestResumeTest, AReleasedSessionIsInTheMap) {
  const DaemonProcess daemon(NewData(), {"--cell-size", "0.2", "--quarantine-max-speed-mps", "1",
                                         "--quarantine-max-jump-m", "0"});
  const CommandRun fast = Ingest(daemon);
  ASSERT_EQ(fast.exit_code, 0) << fast.err;
  ASSERT_NE(fast.err.find("is quarantined, not in the map"), std::string::npos) << fast.err;
  ASSERT_EQ(RunAtlas(daemon.address(), {"session", "release", "vehicle/overpass"}).exit_code, 0);
  const CommandRun again = Ingest(daemon);
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.err.find("vehicle/overpass is"), std::string::npos) << again.err;
  EXPECT_EQ(again.json().at("session_states").at(0).at("in_map"), true);
}

// Each begins with a keyframe alone, and one of these comes first.
TEST_F(IngestResumeTest, OfTwoDrivesThatAreSentAtOnceUnderOneNameOneIsStored) {
  const std::vector<std::vector<std::string>> drives = {{}, {"--rings", "8"}};
  std::map<std::string, std::size_t> digests;  // of each alone
  for (std::size_t i = 0; i < drives.size(); ++i) {
    const DaemonProcess daemon(NewData(), kSmall);
    ASSERT_EQ(Ingest(daemon, drives[i]).exit_code, 0);
    digests[Digest(daemon)] = i;
  }
  ASSERT_EQ(digests.size(), 2U);
  for (int round = 0; round < 3; ++round) {
    const DaemonProcess daemon(NewData(), kSmall);
    std::array<CommandRun, 2> runs;
    std::thread other([&] { runs[1] = Ingest(daemon, drives[1]); });
    runs[0] = Ingest(daemon, drives[0]);
    other.join();
    const std::string digest = Digest(daemon);
    ASSERT_TRUE(digests.contains(digest)) << "a mixture";
    const std::size_t winner = digests[digest];
    EXPECT_EQ(runs[winner].exit_code, 0) << runs[winner].err;
    const CommandRun& loser = runs[1 - winner];
    EXPECT_EQ(loser.exit_code, static_cast<int>(ExitCode::kConflict)) << loser.err;
    EXPECT_EQ(loser.err.find("were stored"), std::string::npos) << loser.err;
  }
}

TEST_F(IngestResumeTest, NorDoesOneThatBeginsBeforeWhatIsThere) {
  for (const char* const order : {"0", "3"}) {
    const DaemonProcess daemon(NewData(), kSmall);
    ASSERT_EQ(Ingest(daemon, {"--range", "20:30"}).exit_code, 0);
    const std::string first = Digest(daemon);
    const CommandRun other = Ingest(daemon, {"--rings", "8", "--shuffle", order});
    EXPECT_EQ(other.exit_code, static_cast<int>(ExitCode::kConflict)) << other.err;
    EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, 10U);
    EXPECT_EQ(Digest(daemon), first);
  }
}

TEST_F(IngestResumeTest, APurgedSessionIsNotTakenForOneWithOtherOptions) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--range", "0:3"}).exit_code, 0);
  ASSERT_EQ(RunAtlas(daemon.address(), {"session", "purge", "vehicle/overpass", "--yes"}).exit_code,
            0);
  const CommandRun again = Ingest(daemon);
  EXPECT_EQ(again.exit_code, static_cast<int>(ExitCode::kConflict)) << again.err;
  EXPECT_NE(again.err.find("purged"), std::string::npos) << again.err;
  EXPECT_EQ(again.err.find("--deskew"), std::string::npos) << again.err;
}

TEST_F(IngestResumeTest, AnotherAtlasAtTheSameAddressEndsTheRun) {
  auto daemon = std::make_unique<DaemonProcess>(NewData(), kSmall);
  const Endpoint address = *Endpoint::Parse(daemon->address());
  const IngestOptions options = OverpassOptions(std::chrono::seconds(30));
  bool is_replaced = false;
  const auto replace = [&](std::size_t done, std::size_t) {
    if (done != 10 || std::exchange(is_replaced, true)) return;
    daemon.reset();
    daemon.reset(new DaemonProcess(DaemonProcess::Begin(NewData(), address.ToText(), kSmall)));
    ASSERT_EQ(daemon->AwaitListening(), "listening " + address.ToText());
  };
  AtlasLink link = LinkTo(address);
  const auto drive = OpenDriveFolder(shared_drive.string());
  const auto report = IngestDrive(*drive, options, link, replace);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code(), StatusCode::kConflict);
  const std::string& message = report.error().message();
  EXPECT_NE(message.find("another atlas"), std::string::npos) << message;
  EXPECT_EQ(message.find("goes on there"), std::string::npos) << message;
  EXPECT_EQ(Connect(*daemon).ReadStatus()->keyframes, 0U);
}

TEST_F(IngestResumeTest, OtherVehiclesSessionsAreNotTakenForOnesOwn) {
  const DaemonProcess daemon(NewData(), kSmall);
  for (const char* vehicle : {"a", "vehicle", "w"}) {
    ASSERT_EQ(Ingest(daemon, {"--vehicle", vehicle, "--range", "0:12"}).exit_code, 0);
  }
  AtlasClient client = Connect(daemon);
  const auto sessions = client.ListSessions("vehicle");
  ASSERT_TRUE(sessions) << sessions.error().message();
  ASSERT_EQ(sessions->size(), 1U);
  EXPECT_EQ(sessions->front().key, (SessionKey{"vehicle", "overpass"}));
  EXPECT_EQ(client.ListSessions()->size(), 3U);
  EXPECT_TRUE(client.ListSessions("v")->empty());
  EXPECT_EQ(Ingest(daemon, {"--range", "0:20"}).Get<std::size_t>("sent_before"), 12 - kSentTwice);
}

TEST_F(IngestResumeTest, AnotherPartOfTheDriveIsNotTakenForTheBeginning) {
  const std::string clean = DigestOfCleanRun();
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--range", "20:30"}).exit_code, 0);
  const CommandRun whole = Ingest(daemon);
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_EQ(whole.Get<int>("sent_before"), 0);
  EXPECT_EQ(Digest(daemon), clean);
}

}  // namespace
}  // namespace atlas
