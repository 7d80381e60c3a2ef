// Backups of a daemon in a process of its own while a fleet drives, and what vehicles do after one
// was restored.
#include <atomic>
#include <csignal>
#include <filesystem>
#include <future>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "client/atlas_file/backup_restore.h"
#include "client/vehicle/upload_spool.h"
#include "core/base/hash.h"
#include "tests/client/end_to_end/daemon_process.h"
#include "tests/client/ledger/clean_atlas.h"
#include "tests/client/link_faults/upload_load.h"

namespace atlas::testing {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

constexpr int kVehicles = 4;
constexpr std::uint32_t kFrames = 64;  // of each, in two sessions

std::vector<FrameId> Frames(std::uint32_t begin, std::uint32_t end) {
  std::vector<FrameId> frames;
  for (std::uint32_t i = begin; i < end; ++i) {
    frames.push_back({i / kFramesOfASession, i % kFramesOfASession});
  }
  return frames;
}

class BackupLifeTest : public ::testing::Test {
 protected:
  BackupLifeTest()
      : folder_(fs::path(::testing::TempDir()) / ("atlas_backup." + std::to_string(getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "backups");
  }
  ~BackupLifeTest() override { fs::remove_all(folder_); }

  std::vector<std::string> Flags(const std::string& mib_per_s = "0") const {
    return {"--cell-size",        "0.2",
            "--log-level",        "error",
            "--backup-folder",    (folder_ / "backups").string(),
            "--backup-mib-per-s", mib_per_s};
  }
  static AtlasClient Connect(const DaemonProcess& daemon) {
    ConnectionOptions options;
    options.endpoint = {"127.0.0.1", daemon.port()};
    options.resume = FleetSession(0, 1);
    auto client = AtlasClient::Connect(options);
    if (!client) {
      throw std::runtime_error(client.error().message());
    }
    return *std::move(client);
  }
  static UploadLoad Load(const DaemonProcess& daemon, int vehicle, std::vector<FrameId> frames) {
    return {{"127.0.0.1", daemon.port()}, vehicle, std::move(frames), seconds(60)};
  }
  static Bytes Digest(AtlasClient& client) {
    const auto digest = client.Digest(seconds(120));
    EXPECT_TRUE(digest) << digest.error().message();
    return digest ? digest->sha256 : Bytes();
  }
  static BackupSummary Backup(AtlasClient& client, const std::string& name) {
    const auto done = client.Backup(name, "tester", seconds(60), [](const BackupStage&) {});
    EXPECT_TRUE(done) << done.error().message();
    return done.value_or(BackupSummary());
  }
  // A data directory whose atlas is the backup as it is.
  fs::path Unpack(const std::string& name) const {
    const fs::path data = folder_ / (name + ".data");
    fs::create_directories(data);
    fs::copy_file(folder_ / "backups" / name, data / "atlas.db");
    return data;
  }
  void Restore(const std::string& name) const {
    const auto done = RestoreBackup({folder_ / "backups" / name, folder_ / "data" / "atlas.db",
                                     true, [] { return Status(); },
                                     [](std::uint64_t, std::uint64_t) {
                                     }});
    ASSERT_TRUE(done) << done.error().message();
    EXPECT_FALSE(done->kept.empty());
  }

  const fs::path folder_;
};

TEST_F(BackupLifeTest, IsTheAtlasOfItsRevisionWhileAFleetDrives) {
  DaemonProcess daemon(folder_ / "data", Flags("1"));
  for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
    ASSERT_TRUE(UploadDirectly(Load(daemon, vehicle, Frames(0, 8))));
  }
  std::vector<std::future<Result<UploadCount>>> drives;
  for (int vehicle = 0; vehicle < kVehicles; ++vehicle) {
    drives.push_back(std::async(
        std::launch::async,
        [load = Load(daemon, vehicle, Frames(8, kFrames))] { return UploadDirectly(load); }));
  }
  std::atomic<bool> is_over = false;
  std::future<std::uint32_t> corrections = std::async(std::launch::async, [&] {
    AtlasClient client = Connect(daemon);
    std::uint32_t count = 0;
    while (!is_over) {
      const FrameId frame{0, count % 8};
      const PoseCorrection one{FleetKey(static_cast<int>(count % kVehicles), frame),
                               FleetPose(static_cast<int>(count % kVehicles), frame, ++count)};
      EXPECT_TRUE(client.UpdatePoses({&one, 1}, "tester"));
    }
    return count;
  });
  AtlasClient client = Connect(daemon);
  std::vector<BackupSummary> backups;
  for (const char* name : {"first", "second", "third"}) {
    backups.push_back(Backup(client, name));
  }
  is_over = true;
  EXPECT_GT(corrections.get(), 0U);
  for (auto& drive : drives) {
    ASSERT_TRUE(drive.get());
  }
  const auto status = client.ReadStatus();
  EXPECT_LT(backups[0].keyframes, status->keyframes) << "it was not written meanwhile";
  EXPECT_LT(backups[0].revision, backups[1].revision);
  for (std::size_t i = 0; i < backups.size(); ++i) {
    const std::string name = std::vector<std::string>{"first", "second", "third"}[i];
    SCOPED_TRACE(name);
    const auto then = client.Digest(seconds(120), backups[i].revision);
    ASSERT_TRUE(then) << then.error().message();
    const fs::path data = Unpack(name);
    const StoredAtlas stored = ReadStoredAtlas(data);
    EXPECT_EQ(stored.frames.size(), backups[i].keyframes);
    EXPECT_EQ(then->sha256, CleanDigest(stored, folder_ / (name + ".clean"), Flags()));
    DaemonProcess of_copy(data, Flags());
    AtlasClient copy = Connect(of_copy);
    EXPECT_EQ(Digest(copy), then->sha256);
    const auto verified = copy.Verify(true, seconds(60));
    ASSERT_TRUE(verified) << verified.error().message();
    EXPECT_EQ(verified->damaged + verified->mismatched, 0U);
  }
}

TEST_F(BackupLifeTest, AVehicleThatGoesOnAfterARestoreLosesNothingThatItHas) {
  AtlasIdentity before;
  std::uint64_t lost = 0;
  SyncQuery part;
  part.area = DiscArea{{0.0, 0.0}, 1e6};
  part.budget_bytes = 20'000;
  const auto leave = [](const TileBlob&) {
    return Status();
  };
  const std::uint32_t backed_up = kFrames / 2 + 5;
  UploadSpool spool = *UploadSpool::Open({.folder = folder_ / "spool"});
  const auto put = [&spool](const FrameId& frame) {
    const KeyframeKey key = FleetKey(2, frame);
    const Bytes blob = FleetBlob(key);
    ASSERT_TRUE(spool.Put({key, FleetTime(frame), FleetPose(2, frame, 0), blob}).ok());
  };
  {
    DaemonProcess daemon(folder_ / "data", Flags());
    ASSERT_TRUE(UploadDirectly(Load(daemon, 0, Frames(0, backed_up))));
    ASSERT_TRUE(UploadDirectly(Load(daemon, 1, Frames(0, 8))));
    AtlasClient client = Connect(daemon);
    EXPECT_EQ(client.atlas().last_sequence, backed_up - 1 - kFramesOfASession);
    ASSERT_TRUE(client.WaitUntilFused(seconds(60)));
    const auto first = client.Sync(part, leave);
    ASSERT_TRUE(first) << first.error().message();
    ASSERT_FALSE(first->cursor.empty()) << "all of it is within the budget";
    part.cursor = first->cursor;
    ASSERT_TRUE(client.Sync(part, leave));
    Backup(client, "monday");
    ASSERT_TRUE(UploadDirectly(Load(daemon, 0, Frames(backed_up, kFrames))));
    for (const FrameId& frame : Frames(0, 4)) put(frame);
    ASSERT_TRUE(spool.Send(client));
    EXPECT_EQ(spool.waiting(), 0U);
    for (const FrameId& frame : Frames(4, 12)) put(frame);  // these wait when the disk is lost
    AtlasClient later = Connect(daemon);
    before = later.atlas();
    EXPECT_EQ(before.last_sequence, kFramesOfASession - 1);
    lost = before.revision;
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  ASSERT_NO_FATAL_FAILURE(Restore("monday"));
  DaemonProcess daemon(folder_ / "data", Flags());
  AtlasClient client = Connect(daemon);
  EXPECT_EQ(client.atlas().atlas_id, before.atlas_id) << "the atlas is the same";
  EXPECT_NE(client.atlas().epoch, before.epoch) << "nobody would notice";
  EXPECT_GT(client.atlas().revision, lost) << "a number would mean two things";
  EXPECT_EQ(client.atlas().last_sequence, backed_up - 1 - kFramesOfASession);
  const auto past = client.Digest(seconds(60), lost);
  ASSERT_FALSE(past);
  EXPECT_EQ(past.error().code(), StatusCode::kNotFound);
  SyncQuery query;
  query.area = DiscArea{{0.0, 0.0}, 1e6};
  query.wait_revision = lost;
  const auto waited = client.Sync(query, leave);
  ASSERT_FALSE(waited) << "what was lost is not there, whatever is";
  EXPECT_EQ(waited.error().code(), StatusCode::kNotFound);
  const auto behind = client.Sync(part, leave);
  ASSERT_FALSE(behind) << "what lies before it is what it was earlier";
  EXPECT_EQ(behind.error().code(), StatusCode::kInvalidArgument);
  // One has all of its drive, and goes on behind what is there; one has what waits in its spool.
  const auto resumed = UploadResuming(Load(daemon, 0, Frames(0, kFrames)));
  ASSERT_TRUE(resumed) << resumed.error().message();
  EXPECT_EQ(resumed->sent, kFrames - backed_up);
  const auto report = spool.Send(client);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_TRUE(report->is_restored) << "what was acknowledged may be lost";
  EXPECT_EQ(report->acknowledged, 8U);
  const auto again = spool.Send(client);
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->is_restored) << "it is told once";
  EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  const StoredAtlas stored = ReadStoredAtlas(folder_ / "data");
  EXPECT_EQ(stored.twice, 0U);
  EXPECT_EQ(stored.frames.size(), kFrames + 8 + 8);
  for (const FrameId& frame : Frames(0, kFrames)) {
    EXPECT_TRUE(stored.frames.contains(FleetKey(0, frame)));
  }
  for (const FrameId& frame : Frames(4, 12)) {
    EXPECT_TRUE(stored.frames.contains(FleetKey(2, frame)));
  }
}

}  // namespace
}  // namespace atlas::testing
