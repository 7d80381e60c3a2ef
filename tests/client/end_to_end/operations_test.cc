// The daemon as whoever runs it sees it: other settings while it runs, and what it tells as it
// stops.
#include <csignal>
#include <fstream>
#include <future>

#include <boost/json/parse.hpp>
#include <sys/resource.h>

#include "client/drive/drive_ingest.h"
#include "tests/client/end_to_end/vehicle_fixture.h"
#include "tests/server/http/http_peer.h"
#include "tests/server/net/blocking_peer.h"

namespace atlas {
namespace {

class OperationsEndToEndTest : public VehicleTest {
 protected:
  static void Write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }
  static fs::path NewFile() {
    return shared_root / ("atlasd" + std::to_string(++shared_data) + ".toml");
  }
  static std::string Message(const std::string& line) {
    return std::string(boost::json::parse(line).at("message").as_string());
  }
  static bool Serves(const DaemonProcess& daemon) {
    return RunAtlas(daemon.address(), {"status"}).exit_code == 0;
  }
};

TEST_F(OperationsEndToEndTest, AGoodFileTakesEffectAndABadOneDoesNot) {
  const fs::path file = NewFile();
  Write(file, "log_format = 'text'\n[map]\ncell_size = 0.2\n");
  DaemonProcess daemon(NewData(), {"--config", file.string()}, DaemonProcess::Log::kKept);
  EXPECT_NE(daemon.ReadLogUntil("atlas in").find("[info] atlas in "), std::string::npos);

  Write(file, "log_format = 'json'\nworkers = 7\n[map]\ncell_size = 0.2\n");
  daemon.Signal(SIGHUP);
  EXPECT_EQ(Message(daemon.ReadLogUntil("configuration")),
            "signal 1: configuration and its files read again, log_format changed");
  EXPECT_EQ(Message(daemon.ReadLogUntil("restart")),
            "signal 1: changes that need a restart: workers");

  Write(file, "log_format = 'text'\nlog_level = 'loud'\n");
  daemon.Signal(SIGHUP);
  const std::string refused = Message(daemon.ReadLogUntil("configuration"));
  EXPECT_NE(refused.find("is refused, the old one stays: invalid_argument"), std::string::npos);
  EXPECT_NE(refused.find(file.string() + ": line 2: log_level is 'loud'"), std::string::npos);
  fs::remove(file);
  daemon.Signal(SIGHUP);
  EXPECT_NE(Message(daemon.ReadLogUntil("configuration")).find("not_found: "), std::string::npos);

  EXPECT_TRUE(Serves(daemon));
  EXPECT_EQ(daemon.Stop(SIGTERM), 0);
}

TEST_F(OperationsEndToEndTest, TheLogNamesWhatWasNewWhenItWasReadAgain) {
  const fs::path tokens = NewFile();
  Write(tokens, "");
  DaemonProcess daemon(NewData(), {"--tokens", tokens.string()}, DaemonProcess::Log::kKept);
  daemon.ReadLogUntil("atlas in");
  daemon.Signal(SIGHUP);
  EXPECT_NE(daemon.ReadLogUntil("signal 1").find("read again, no setting and no file changed"),
            std::string::npos);
  Write(tokens, "# nobody yet");
  daemon.Signal(SIGHUP);
  EXPECT_NE(daemon.ReadLogUntil("signal 1").find("read again, file of access.tokens changed"),
            std::string::npos);
}

TEST_F(OperationsEndToEndTest, AFailedRequestIsALineWithItsIds) {
  DaemonProcess daemon(NewData(), {"--log-format", "json"}, DaemonProcess::Log::kKept);
  EXPECT_EQ(RunAtlas(daemon.address(), {"session", "retract", "bus/day"}).exit_code, 3);
  const auto line = boost::json::parse(daemon.ReadLogUntil("failed"));
  EXPECT_EQ(line.at("level").as_string(), "info");
  EXPECT_EQ(line.at("kind").as_string(), "change_session");
  EXPECT_EQ(line.at("code").as_string(), "not_found");
  EXPECT_GT(line.at("request_id").to_number<std::uint64_t>(), 0U);
  EXPECT_EQ(line.at("peer").as_string().rfind("127.0.0.1:", 0), 0U);
  EXPECT_FALSE(line.at("client").as_string().empty());
}

TEST_F(OperationsEndToEndTest, TheLogIsJsonWhateverAPeerSends) {
  DaemonProcess daemon(NewData(), {"--log-format", "json"}, DaemonProcess::Log::kKept);
  daemon.ReadLogUntil("atlas in");
  const BlockingPeer peer(daemon.port());
  const Bytes hello = {0x08, 1, 0x12, 5, 0x08, 1, 0x1a, 1, 0xff};  // client_name is not UTF-8
  Bytes frame = EncodeFrameHeader(hello);
  frame.insert(frame.end(), hello.begin(), hello.end());
  ASSERT_TRUE(peer.SendBytes(frame));
  EXPECT_NE(Message(daemon.ReadLogUntil("")).find("envelope: "), std::string::npos);
}

#ifdef FAILING_SYNC_PATH
TEST_F(OperationsEndToEndTest, AFailedSyncEndsTheDaemonAndNothingAcknowledgedIsLost) {
  const fs::path data = NewData();
  const fs::path switched_on = NewFile();
  setenv("LD_PRELOAD", FAILING_SYNC_PATH, 1);
  setenv("FAILING_SYNC", switched_on.c_str(), 1);
  DaemonProcess daemon(data, {"--cell-size", "0.2"}, DaemonProcess::Log::kKept);
  unsetenv("LD_PRELOAD");
  unsetenv("FAILING_SYNC");
  ASSERT_EQ(Ingest(daemon, {"--session", "first"}).exit_code, 0);
  ASSERT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);
  Write(switched_on, "");
  IngestOptions second;
  second.session = {"vehicle", "second"};
  second.max_range_m = 12.0;
  second.upload.patience = std::chrono::milliseconds(300);  // the command's is a minute
  AtlasLink link = LinkTo(*Endpoint::Parse(daemon.address()));
  const auto drive = OpenDriveFolder(shared_drive.string());
  EXPECT_FALSE(IngestDrive(*drive, second, link, {}));
  const std::string line = daemon.ReadLogUntil("[critical]");
  EXPECT_NE(line.find("the disk failed to sync"), std::string::npos) << line;
  EXPECT_NE(daemon.ReadLogUntil("stopped"), "");
  EXPECT_EQ(daemon.Stop(0), 1);

  DaemonProcess again(data, {});
  EXPECT_EQ(RunAtlas(again.address(), {"wait"}).exit_code, 0);
  const CommandRun sessions = RunAtlas(again.address(), {"sessions"});
  EXPECT_NE(sessions.out.find("first"), std::string::npos) << sessions.out;
  const CommandRun verified = RunAtlas(again.address(), {"verify", "--rebuild"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  EXPECT_EQ(Ingest(again, {"--session", "second"}).exit_code, 0);
}

TEST_F(OperationsEndToEndTest, ADiskThatBecomesReadOnlyStopsUploadsUntilItIsNot) {
  const fs::path switched_on = NewFile();
  setenv("LD_PRELOAD", READ_ONLY_DISK_PATH, 1);
  setenv("READ_ONLY_DISK", switched_on.c_str(), 1);
  DaemonProcess daemon(NewData(), {"--cell-size", "0.2", "--http", "127.0.0.1:0"},
                       DaemonProcess::Log::kKept);
  unsetenv("LD_PRELOAD");
  unsetenv("READ_ONLY_DISK");
  ASSERT_EQ(Ingest(daemon, {"--session", "first"}).exit_code, 0);
  const std::string first = Digest(daemon);
  const int keyframes = RunAtlas(daemon.address(), {"status"}).Get<int>("keyframes");
  Write(switched_on, "");
  auto second = std::async(std::launch::async, [&daemon] {
    return Ingest(daemon, {"--session", "second"});
  });
  EXPECT_NE(daemon.ReadLogUntil("(upload_keyframe) failed"), "");
  const CommandRun changed = RunAtlas(daemon.address(), {"vehicle", "retract", "vehicle"});
  EXPECT_EQ(changed.exit_code, 5) << changed.out << changed.err;
  EXPECT_NE(changed.err.find("disk I/O error"), std::string::npos) << changed.err;
  const HttpAnswer ready = Ask(daemon.http_port(), "/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_NE(ready.body.find("disk I/O error"), std::string::npos) << ready.body;
  EXPECT_EQ(Digest(daemon), first) << "reads go on";
  EXPECT_EQ(RunAtlas(daemon.address(), {"status"}).Get<int>("keyframes"), keyframes);

  fs::remove(switched_on);
  const CommandRun ingested = second.get();
  EXPECT_EQ(ingested.exit_code, 0) << "it went on by itself: " << ingested.err;
  EXPECT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);
  const CommandRun verified = RunAtlas(daemon.address(), {"verify", "--rebuild"});
  EXPECT_EQ(verified.exit_code, 0) << verified.out << verified.err;
  EXPECT_EQ(daemon.Stop(SIGTERM), 0);
}
#endif

TEST_F(OperationsEndToEndTest, AFileThatMayNotGrowStopsChangesUntilItMay) {
  DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  const std::string before = Digest(daemon);
  daemon.LimitFiles(4'096);
  const CommandRun refused = RunAtlas(daemon.address(), {"vehicle", "retract", "vehicle"});
  EXPECT_EQ(refused.exit_code, 5) << refused.out << refused.err;
  EXPECT_NE(refused.err.find("no file may be larger than 4096 bytes here (ulimit -f)"),
            std::string::npos)
      << refused.err;
  EXPECT_EQ(Digest(daemon), before) << "reads go on";

  daemon.LimitFiles(RLIM_INFINITY);
  EXPECT_EQ(RunAtlas(daemon.address(), {"vehicle", "retract", "vehicle"}).exit_code, 0);
  EXPECT_NE(Digest(daemon), before);
  EXPECT_EQ(daemon.Stop(SIGTERM), 0);
}

TEST_F(OperationsEndToEndTest, ADaemonThatDrainsTells) {
  DaemonProcess daemon(NewData(), {"--cell-size", "0.2", "--http", "127.0.0.1:0"});
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  ASSERT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);
  EXPECT_EQ(Ask(daemon.http_port(), "/readyz").status, 200);
  EXPECT_EQ(Ask(daemon.http_port(), "/healthz").body, "ok\n");
  EXPECT_NE(Ask(daemon.http_port(), "/metrics").body.find("\nroadatlas_dirty_tiles 0\n"),
            std::string::npos);

  // A peer that reads nothing holds the daemon up.
  auto peer = std::make_unique<BlockingPeer>(daemon.port(), 4'096);
  ASSERT_TRUE(peer->Greet().has_hello_reply());
  Bytes queries;
  for (std::uint64_t id = 1; id <= 2'000; ++id) {
    wire::Envelope query;
    query.set_request_id(id);
    query.mutable_query_region();
    const Bytes frame = EncodeEnvelopeFrame(query).value();
    queries.insert(queries.end(), frame.begin(), frame.end());
  }
  peer->SendBytes(queries);
  daemon.Signal(SIGTERM);
  EXPECT_EQ(AskUntil(daemon.http_port(), "/readyz", 503).body, "draining\n");
  EXPECT_EQ(Ask(daemon.http_port(), "/healthz").status, 200);
  peer.reset();
  EXPECT_EQ(daemon.Stop(SIGTERM), 0);
}

TEST_F(OperationsEndToEndTest, AnOperationsPortThatIsTakenLeavesNoTrace) {
  DaemonProcess daemon(NewData(), {"--http", "127.0.0.1:0"});
  const fs::path data = NewData();
  const std::string taken = "127.0.0.1:" + std::to_string(daemon.http_port());
  EXPECT_THROW(DaemonProcess(data, {"--http", taken}), std::runtime_error);
  EXPECT_FALSE(fs::exists(data));
}

}  // namespace
}  // namespace atlas
