// What is noted of damage, while that is damaged or cannot be written, and names that a repair
// gives.
#include <csignal>
#include <future>
#include <map>
#include <memory>
#include <thread>

#include <sys/resource.h>

#include "core/tile/tile_codec.h"
#include "tests/server/service/damage_fixture.h"

namespace atlas {
namespace {

class DamagedNotesTest : public DamageTest {
 protected:
  Result<AtlasFacts> BackUp() {
    BackupWork work;
    work.payload_of = [](ByteSpan blob) {
      return TilePayloadFromBlob(blob);
    };
    const std::filesystem::path file = directory_ / "backup";
    std::filesystem::remove(file);
    return store_->WriteBackup(file, work);
  }
};

TEST_F(DamagedNotesTest, ADamagedNoteIsNamedAndARepairSettlesIt) {
  for (const char* const damage : {"keyframe_id = 5", "keyframe_id = 3", "keyframe_id = 4 + 65536",
                                   "reason = 'other'", "revision = revision + 1", "time_ms = 0"}) {
    SCOPED_TRACE(damage);
    Fill();
    Tamper(kSpoilBlob);
    ASSERT_TRUE(service_->Verify({}, Long()));
    ASSERT_EQ(Listed(), 1U);
    Tamper("UPDATE damaged_keyframes SET " + std::string(damage));
    const auto found = service_->Verify({}, Long());
    ASSERT_TRUE(found) << found.error().message();
    EXPECT_THAT(found->findings, ::testing::Contains(::testing::HasSubstr("what is noted of")));
    const auto repaired = Repair();
    ASSERT_TRUE(repaired) << repaired.error().message();
    EXPECT_EQ(repaired->given_up, 1U);
    EXPECT_EQ(Listed(), 0U);
    Digest();
    const auto report = service_->Verify({.rebuild = true}, Long());
    EXPECT_EQ(report->damaged, 0U) << report->findings.at(0);
    const auto backup = BackUp();
    EXPECT_TRUE(backup) << backup.error().message();
    ASSERT_TRUE(Upload(DriveUpload(3)));
    EXPECT_EQ(Digest().sha256, intact_.sha256);
    Close();
    std::filesystem::remove_all(directory_ / "data");
  }
}

// Its keyframes would go with the session whose row was written over.
TEST_F(DamagedNotesTest, ALostSessionTakesNobodysName) {
  Fill();
  const auto upload = [this](std::uint32_t i, const std::string& session) {
    UploadRequest request = DriveUpload(i, session);
    request.key.session.vehicle = "lost";
    ASSERT_TRUE(Upload(std::move(request)));
  };
  upload(0, "session-1");
  upload(1, "session-1");
  upload(2, "session-1-2");
  upload(3, "session-9");
  Digest();
  Tamper("DELETE FROM sessions WHERE id = 1");
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_EQ(repaired->given_up, 0U);
  std::map<std::string, std::uint64_t> keyframes;
  const auto sessions = store_->ListSessions({}, 10).value();
  for (const SessionRecord& session : sessions) {
    keyframes[session.key.vehicle + "/" + session.key.session] = session.keyframes;
  }
  EXPECT_THAT(keyframes,
              ::testing::ElementsAre(::testing::Pair("lost/session-1", 2U),
                                     ::testing::Pair("lost/session-1-2", 1U),
                                     ::testing::Pair("lost/session-1-3", std::uint64_t{kDrive}),
                                     ::testing::Pair("lost/session-9", 1U)));
  Digest();
  const auto report = service_->Verify({.rebuild = true}, Long());
  EXPECT_EQ(report->damaged + report->mismatched, 0U) << report->findings.at(0);
}

// As long as it is there no more than the beginning of a file can be written, as if the disk were
// full.
class FullDisk {
 public:
  FullDisk() {
    ::signal(SIGXFSZ, SIG_IGN);
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &before_), 0);
    const rlimit full{4'096, before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() { EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &before_), 0); }

 private:
  rlimit before_{};
};

TEST_F(DamagedNotesTest, WhatIsFoundIsToldWhereItCannotBeNoted) {
  Fill();
  Tamper(std::string(kSpoilBlob) +
         ";UPDATE tiles SET blob = zeroblob(blob_bytes) WHERE key = (SELECT max(key) FROM tiles)");
  auto full = std::make_unique<FullDisk>();
  const auto found = service_->Verify({}, Long());
  const auto repaired = Repair();
  full.reset();
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_EQ(found->damaged, 2U);
  ASSERT_EQ(found->findings.size(), 3U);
  EXPECT_THAT(found->findings[0], ::testing::HasSubstr("the blob of keyframe 4 is damaged"));
  EXPECT_THAT(found->findings[2], ::testing::HasSubstr("could not be noted"));
  EXPECT_EQ(found->restored, 0U);
  EXPECT_FALSE(repaired) << "nothing was";
  EXPECT_EQ(Listed(), 0U);
  ASSERT_TRUE(service_->Verify({}, Long()));
  EXPECT_EQ(Listed(), 1U) << "it goes on where there is room";
}

// Nobody fuses here: as if workers had not come to the tiles before the disk was full.
TEST_F(DamagedNotesTest, ARepairUnderWhichTheDiskFillsEnds) {
  Fill();
  Tamper("UPDATE tiles SET blob = zeroblob(blob_bytes) WHERE key = (SELECT max(key) FROM tiles)");
  Open(0);
  auto repaired = std::async(std::launch::async, [this] {
    return service_->Verify({.repair = true, .author = "operator"}, {std::chrono::hours(1), {}});
  });
  while (store_->ReadDirtyState()->dirty_tiles == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const FullDisk full;
  const auto latest = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (repaired.wait_for(std::chrono::milliseconds(20)) != std::future_status::ready) {
    if (std::chrono::steady_clock::now() > latest) {
      service_->EndWaits();
    }
    EXPECT_FALSE(Await<std::uint32_t>([this](auto done) {
      store_->MarkDirty({{0, 500, 500}}, std::move(done));
    }));
  }
  const auto end = repaired.get();
  ASSERT_FALSE(end);
  EXPECT_THAT(end.error().message(),
              ::testing::HasSubstr("1 tiles are to be fused, and cannot be written"));
}

}  // namespace
}  // namespace atlas
