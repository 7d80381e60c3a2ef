// Restores of an atlas that had gone on: what it gave numbers to is told by its note, its database,
// its log and what was kept of it before, and is given none again.
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "tests/server/store/backup_fixture.h"

namespace atlas {
namespace {

class FormerRevisionsTest : public BackupTest {
 protected:
  static void Write(const std::filesystem::path& file, std::string_view text) {
    std::ofstream(file) << text;
  }
  static std::string Read(const std::filesystem::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  // An atlas in its first line behind a backup, that went on for a while.
  void Prepare() {
    Fill(3);
    ASSERT_TRUE(WriteBackup().has_value());
    ASSERT_TRUE(Restore().has_value());
    OpenRestored();
    ASSERT_TRUE(Put(Keyframe(4)).has_value());
    epoch_ = store_->identity().epoch;
    revision_ = store_->revision();
  }
  void ExpectGivenOnce() {
    const auto done = Restore(true);
    ASSERT_TRUE(done.has_value()) << done.error().message();
    EXPECT_GT(done->epoch, epoch_);
    EXPECT_GT(LineOf(done->revision), LineOf(revision_)) << "its revisions are given again";
    Open();
    EXPECT_EQ(store_->CheckRevision(revision_).code(), StatusCode::kNotFound);
  }
  std::filesystem::path Note() const { return restored().string() + "-revision"; }

  std::uint64_t epoch_ = 0;
  std::uint64_t revision_ = 0;
};

TEST_F(FormerRevisionsTest, TheDatabaseTellsThemWithoutItsNote) {
  Prepare();
  store_.reset();
  Write(Note(), "torn");
  ExpectGivenOnce();
}

TEST_F(FormerRevisionsTest, SoDoesItsLog) {
  Fill(3);
  ASSERT_TRUE(WriteBackup().has_value());
  ASSERT_TRUE(Restore().has_value());
  const std::filesystem::path wal = restored().string() + "-wal";
  OpenRestored();
  store_.reset();
  const std::string early = Read(restored());
  std::filesystem::remove(restored());
  std::filesystem::copy_file(backup(), restored());
  ASSERT_TRUE(Restore(true).has_value());  // two lines behind the backup
  Open();
  epoch_ = store_->identity().epoch;
  revision_ = store_->revision();
  store_.reset();
  Write(restored(), early);  // and goes to its line behind a loss, that only its log has
  Open();
  ASSERT_GT(LineOf(store_->revision()), LineOf(revision_));
  epoch_ = store_->identity().epoch;
  revision_ = store_->revision();
  const std::string database = Read(restored());
  const std::string log = Read(wal);
  store_.reset();
  ASSERT_FALSE(log.empty());
  Write(restored(), database);
  Write(wal, log);
  std::filesystem::remove(Note());
  for (int number = 1; number < 3; ++number) {  // older ones, which are in the way of the test
    std::filesystem::remove(restored().string() + ".replaced-" + std::to_string(number));
    std::filesystem::remove(restored().string() + ".replaced-" + std::to_string(number) +
                            "-revision");
  }
  ExpectGivenOnce();
}

// A restore that was interrupted has moved the note with the atlas.
TEST_F(FormerRevisionsTest, SoDoesWhatWasMovedAside) {
  for (const std::string by : {"", "-revision"}) {
    SCOPED_TRACE(by);
    store_.reset();
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(folder());
    options_.directory = directory_ / "data";
    Prepare();
    store_.reset();
    const std::string kept = restored().string() + ".replaced-1";
    std::filesystem::rename(restored().string() + by, kept + by);
    std::filesystem::remove(restored());
    std::filesystem::remove(Note());
    Write(restored().string() + ".partial", "half a copy");
    ExpectGivenOnce();
  }
}

TEST_F(FormerRevisionsTest, WhatIsDamagedOrOfAnotherAtlasSaysNothing) {
  Prepare();
  store_.reset();
  std::filesystem::remove(Note());
  const std::string kept = restored().string() + ".replaced-1";
  std::filesystem::rename(restored(), kept);
  std::ofstream(kept, std::ios::in | std::ios::out).seekp(8'192 * 2) << std::string(8'192 * 3, 'x');
  Write(kept + "0", "no atlas");
  options_.directory = directory_ / "another";
  options_.new_atlas_id = {4, 5, 6};
  Open();
  ASSERT_TRUE(Put(Keyframe(1)).has_value());
  store_.reset();
  std::filesystem::copy_file(Database(), kept + "1");
  const auto done = Restore();
  ASSERT_TRUE(done.has_value()) << done.error().message();
  EXPECT_EQ(LineOf(done->revision), 1U);
}

}  // namespace
}  // namespace atlas
