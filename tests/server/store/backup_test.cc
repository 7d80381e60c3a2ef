#include <algorithm>

#include "server/store/sqlite/store_snapshot.h"
#include "tests/server/store/backup_fixture.h"

namespace atlas {
namespace {

TEST_F(BackupTest, IsOneStateWhileTheAtlasIsWrittenTo) {
  Fill(100, 30'000);
  const std::uint64_t revision = store_->revision();
  BackupWork work = Work();
  std::uint32_t sequence = 100;
  std::vector<BackupProgress> told;
  work.on_progress = [&](const BackupProgress& progress) {
    told.push_back(progress);
    if (progress.stage == BackupProgress::Stage::kCopying) {
      EXPECT_TRUE(Put(Keyframe(++sequence, 30'000)).has_value());
      EXPECT_TRUE(Update({{{{"bus", "day"}, 1}, PoseAt(sequence), {{0, 1, 0}}}}).has_value());
    }
  };
  const auto facts = store_->WriteBackup(backup(), work);
  ASSERT_TRUE(facts.has_value()) << facts.error().message();
  EXPECT_GE(sequence, 103U) << "too few steps to see anything";
  EXPECT_EQ(facts->revision, revision);
  EXPECT_EQ(facts->keyframes, 100U);
  EXPECT_EQ(facts->tiles, 3U);
  EXPECT_EQ(facts->bytes, std::filesystem::file_size(backup()));
  EXPECT_EQ(told.front().stage, BackupProgress::Stage::kCopying);
  EXPECT_EQ(told.back().stage, BackupProgress::Stage::kVerifying);
  EXPECT_EQ(told.back().done_bytes, told.back().total_bytes);
  EXPECT_EQ(NamesIn(folder()), std::vector<std::string>{"monday"});
  EXPECT_EQ(store_->ReadCounts()->keyframes, sequence);
}

TEST_F(BackupTest, IsAnAtlasFile) {
  Fill(3);
  ASSERT_TRUE(WriteBackup().has_value());
  store_.reset();
  auto snapshot = StoreSnapshot::Open(backup());
  ASSERT_TRUE(snapshot.has_value()) << snapshot.error().message();
  const auto tile = snapshot->ReadTile({0, 0, 0});
  ASSERT_TRUE(tile.has_value() && *tile) << "there is a tile";
  EXPECT_EQ((*tile)->blob, Tile(1).blob);
  EXPECT_EQ(NamesIn(folder()), std::vector<std::string>{"monday"});
  EXPECT_EQ(RowsOf(backup()), RowsOf(Database()));
}

TEST_F(BackupTest, ANameThatIsTakenStaysWhatItIs) {
  Fill(1);
  ASSERT_TRUE(WriteBackup().has_value());
  const auto before = std::filesystem::last_write_time(backup());
  const auto again = WriteBackup();
  ASSERT_FALSE(again.has_value());
  EXPECT_EQ(again.error().code(), StatusCode::kConflict);
  EXPECT_EQ(std::filesystem::last_write_time(backup()), before);
}

TEST_F(BackupTest, WithoutItsFolderThereIsNone) {
  Fill(1);
  std::filesystem::remove(folder());
  const auto facts = WriteBackup();
  ASSERT_FALSE(facts.has_value());
  EXPECT_EQ(facts.error().code(), StatusCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(folder()));
}

TEST_F(BackupTest, WithoutRoomItSaysHowMuchItTakes) {
  Fill(1);
  BackupWork work = Work();
  work.reserve_bytes = std::uint64_t{1} << 60U;
  const auto facts = store_->WriteBackup(backup(), work);
  ASSERT_FALSE(facts.has_value());
  EXPECT_EQ(facts.error().code(), StatusCode::kResourceExhausted);
  store_->Flush();
  store_.reset();  // its log is in the database then
  const auto bytes = std::to_string(std::filesystem::file_size(Database()));
  EXPECT_NE(facts.error().message().find("takes " + bytes), std::string::npos)
      << facts.error().message();
  EXPECT_TRUE(NamesIn(folder()).empty());
}

TEST_F(BackupTest, StoppedAnywhereItLeavesNothing) {
  Fill(3);
  int asked = 0;
  BackupWork work = Work();
  work.check_stop = [&asked] {
    ++asked;
    return Status();
  };
  ASSERT_TRUE(store_->WriteBackup(backup(), work).has_value());
  const int all = asked;
  ASSERT_GT(all, 5);
  std::filesystem::remove(backup());
  for (int last = 1; last <= all; ++last) {
    SCOPED_TRACE(last);
    asked = 0;
    work.check_stop = [&asked, last] {
      return ++asked >= last ? Status(StatusCode::kTimeout, "too late") : Status();
    };
    const auto facts = store_->WriteBackup(backup(), work);
    ASSERT_FALSE(facts.has_value());
    EXPECT_EQ(facts.error().code(), StatusCode::kTimeout);
    EXPECT_TRUE(NamesIn(folder()).empty());
  }
}

TEST_F(BackupTest, ADamagedAtlasIsNotBackedUp) {
  for (const char* damage :
       {"UPDATE keyframes SET blob = zeroblob(300) WHERE id = 2",
        "UPDATE tiles SET payload_hash = payload_hash + 1 WHERE key = (SELECT max(key) FROM tiles)",
        "UPDATE pose_batches SET author = 'x'", "UPDATE starts SET revision = 7",
        "UPDATE events SET detail = 'x'", "DELETE FROM pose_history WHERE id = 1",
        "UPDATE session_states SET reason = 'x'"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Fill(3);
    Tamper(damage);
    Open();
    const auto facts = WriteBackup();
    ASSERT_FALSE(facts.has_value());
    EXPECT_EQ(facts.error().code(), StatusCode::kInvalidData) << facts.error().message();
    EXPECT_TRUE(NamesIn(folder()).empty());
  }
}

// The disk gives back something else, and nothing in it is damaged.
TEST_F(BackupTest, ACopyOfAnotherStateIsNone) {
  Fill(1);
  ASSERT_TRUE(WriteBackup().has_value());
  const auto earlier = folder() / "sunday";
  std::filesystem::rename(backup(), earlier);
  ASSERT_TRUE(Update({{{{"bus", "day"}, 1}, PoseAt(7), {{0, 1, 0}}}}).has_value());
  BackupWork work = Work();
  work.on_progress = [&](const BackupProgress& progress) {
    if (progress.stage == BackupProgress::Stage::kCopying) {
      std::filesystem::copy_file(earlier, backup().string() + ".partial",
                                 std::filesystem::copy_options::overwrite_existing);
    }
  };
  const auto facts = store_->WriteBackup(backup(), work);
  ASSERT_FALSE(facts.has_value());
  EXPECT_EQ(facts.error().code(), StatusCode::kInvalidData) << facts.error().message();
  EXPECT_EQ(NamesIn(folder()), std::vector<std::string>{"sunday"});
}

TEST_F(BackupTest, IsAnEvent) {
  Fill(1);
  const auto noted = Await<bool>([&](auto done) {
    store_->NoteBackup({"alice", "monday", "of a test"}, std::move(done));
  });
  ASSERT_TRUE(noted.has_value());
  const auto events = store_->ListEvents(0, 100);
  ASSERT_TRUE(events.has_value() && !events->empty());
  EXPECT_EQ(events->back().kind, EventKind::kBackup);
  EXPECT_EQ(events->back().author, "alice");
  EXPECT_EQ(events->back().subject, "monday");
}

TEST_F(BackupTest, KeepsToItsPace) {
  Fill(100, 30'000);
  BackupWork work = Work();
  work.bytes_per_s = 20e6;
  const auto began = std::chrono::steady_clock::now();
  const auto facts = store_->WriteBackup(backup(), work);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  ASSERT_TRUE(facts.has_value());
  const double blobs = 100 * 30'000.0;  // that are read back
  EXPECT_GE(took.count(), (static_cast<double>(facts->bytes) + blobs) / work.bytes_per_s * 0.9);
}

}  // namespace
}  // namespace atlas
