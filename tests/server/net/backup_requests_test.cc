// Backups over a real socket, of an atlas that is in use.
#include <fstream>

#include "tests/server/net/net_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

class BackupRequestTest : public NetTest {
 protected:
  BackupRequestTest() {
    backups_.folder = directory_ / "backups";
    backups_.reserve_bytes = 0;
    fs::create_directory(backups_.folder);
  }

  static wire::Envelope BackupTo(const std::string& name,
                                 std::uint32_t timeout_ms = 60'000,
                                 std::uint64_t request_id = 5) {
    wire::Envelope envelope;
    envelope.set_request_id(request_id);
    wire::BackupRequest& backup = *envelope.mutable_backup_request();
    backup.set_name(name);
    backup.set_author("tester");
    backup.set_timeout_ms(timeout_ms);
    return envelope;
  }
  // The last reply; those before it say how far it is.
  static wire::Envelope LastOf(BlockingPeer& peer,
                               std::vector<wire::BackupReply>* before = nullptr) {
    while (true) {
      const auto reply = peer.Receive();
      if (!reply) {
        throw std::runtime_error("the connection is gone");
      }
      if (!reply->has_backup_reply() || reply->backup_reply().stage() == wire::BackupReply::DONE) {
        return *reply;
      }
      if (before != nullptr) {
        before->push_back(reply->backup_reply());
      }
    }
  }
  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(backups_.folder)) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }
  // Waits for what a test itself has begun.
  template <typename Condition>
  static void Await(const Condition& condition) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!condition() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    EXPECT_TRUE(condition());
  }
};

TEST_F(BackupRequestTest, IsTheAtlasAndAnEventAndListed) {
  Serve();
  UploadDrive(5);
  const AtlasDigest digest = Digest();
  const auto peer = Connect();
  peer->Send(BackupTo("monday"));
  std::vector<wire::BackupReply> before;
  const wire::Envelope reply = LastOf(*peer, &before);
  ASSERT_TRUE(reply.has_backup_reply()) << reply.ShortDebugString();
  EXPECT_EQ(reply.request_id(), 5u);
  const wire::BackupReply& done = reply.backup_reply();
  EXPECT_EQ(done.revision(), digest.revision);
  EXPECT_EQ(done.tiles(), digest.tiles);
  EXPECT_EQ(done.keyframes(), 5u);
  EXPECT_EQ(BytesFromWire(done.sha256()).size(), digest.sha256.size());
  EXPECT_EQ(done.sha256(), BytesToWire(digest.sha256));
  EXPECT_EQ(done.done_bytes(), fs::file_size(backups_.folder / "monday"));
  EXPECT_FALSE(before.empty()) << "nobody knows how far it is";
  peer->Send(BackupTo(""));
  const auto list = peer->Receive();
  ASSERT_EQ(list->backup_reply().backups_size(), 1);
  EXPECT_EQ(list->backup_reply().backups(0).name(), "monday");
  EXPECT_EQ(list->backup_reply().backups(0).bytes(), done.done_bytes());
  EXPECT_GT(list->backup_reply().backups(0).time_ms(), kTestNow_ms);
  const auto events = service_->ListEvents(0, 1'000);
  EXPECT_EQ(events->back().kind, EventKind::kBackup);
  EXPECT_EQ(events->back().subject, "monday");
  EXPECT_EQ(events->back().author, "tester");
}

TEST_F(BackupRequestTest, NamesAreNoPaths) {
  Serve();
  const auto peer = Connect();
  for (const char* name : {"../monday", "a/b", ".", "..", ".hidden", "a b", "monday.partial",
                           "monday-wal", "monday-shm", "monday-journal"}) {
    SCOPED_TRACE(name);
    peer->Send(BackupTo(name));
    EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kInvalidArgument);
  }
  peer->Send(BackupTo(std::string(65, 'x')));
  EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kInvalidArgument);
  EXPECT_TRUE(Names().empty());
  EXPECT_FALSE(fs::exists(directory_ / "monday"));
}

TEST_F(BackupRequestTest, RefusalsAreTypedAndLeaveNothing) {
  Serve();
  UploadDrive(2);
  const auto peer = Connect();
  peer->Send(BackupTo("monday"));
  ASSERT_TRUE(LastOf(*peer).has_backup_reply());
  peer->Send(BackupTo("monday"));
  EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kConflict);
  peer->Send(BackupTo("tuesday", 0));
  EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kTimeout);
  EXPECT_EQ(Names(), std::vector<std::string>{"monday"});
  fs::remove_all(backups_.folder);
  peer->Send(BackupTo("tuesday"));
  EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kNotFound);
  peer->Send(BackupTo(""));
  EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kNotFound);
  std::ofstream(backups_.folder) << "no folder";
  peer->Send(BackupTo("tuesday"));
  EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kConflict);
}

TEST_F(BackupRequestTest, WithoutAFolderThereAreNone) {
  backups_.folder.clear();
  Serve();
  const auto peer = Connect();
  for (const char* name : {"monday", ""}) {
    peer->Send(BackupTo(name));
    EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kInvalidArgument);
  }
}

TEST_F(BackupRequestTest, WithoutRoomItSaysSo) {
  backups_.reserve_bytes = std::uint64_t{1} << 60U;
  Serve();
  UploadDrive(1);
  const auto peer = Connect();
  peer->Send(BackupTo("monday"));
  const wire::Envelope refused = LastOf(*peer);
  EXPECT_EQ(CodeOf(refused), StatusCode::kResourceExhausted);
  EXPECT_NE(refused.error().message().find("the copy takes"), std::string::npos);
  EXPECT_TRUE(Names().empty());
}

class SlowBackupTest : public BackupRequestTest {
 protected:
  SlowBackupTest() { backups_.bytes_per_s = 20'000; }  // a minute

  void Begin(BlockingPeer& peer, std::uint32_t timeout_ms) {
    peer.Send(BackupTo("monday", timeout_ms));
    Await([this] { return !Names().empty(); });
    EXPECT_EQ(Names(), std::vector<std::string>{"monday.partial"});
  }
  void ExpectEnds() {
    Await([this] { return Names().empty(); });
    ExpectHoldsNothing();
  }
};

TEST_F(SlowBackupTest, OneIsWrittenAtATimeAndUploadsGoOn) {
  Serve();
  UploadDrive(5);
  const auto first = Connect();
  Begin(*first, 60'000);
  const auto second = Connect();
  second->Send(BackupTo("tuesday"));
  EXPECT_EQ(CodeOf(LastOf(*second)), StatusCode::kUnavailable);
  second->Send(UploadOf(6, 7));
  EXPECT_TRUE(second->Receive()->has_upload_reply());
  ExpectServes();
}

TEST_F(SlowBackupTest, ItsTimeEndsIt) {
  Serve();
  UploadDrive(5);
  const auto peer = Connect();
  Begin(*peer, 500);
  EXPECT_EQ(CodeOf(LastOf(*peer)), StatusCode::kTimeout);
  ExpectEnds();
}

TEST_F(SlowBackupTest, WhoLeavesEndsIt) {
  Serve();
  UploadDrive(5);
  auto peer = Connect();
  Begin(*peer, 60'000);
  peer.reset();
  ExpectEnds();
  ExpectServes();
}

TEST_F(SlowBackupTest, TheEndOfTheDaemonEndsIt) {
  Serve();
  UploadDrive(5);
  const auto peer = Connect();
  Begin(*peer, 60'000);
  server_->Stop();
  service_->EndWaits();
  EXPECT_TRUE(HasDrained());
  EXPECT_TRUE(Names().empty());
}

TEST_F(BackupRequestTest, WhatWasNotFinishedGoesAtTheNextStart) {
  std::ofstream(backups_.folder / "monday.partial") << "half";
  std::ofstream(backups_.folder / "sunday") << "somebody's";
  Serve();
  EXPECT_EQ(Names(), std::vector<std::string>{"sunday"});
}

}  // namespace
}  // namespace atlas
