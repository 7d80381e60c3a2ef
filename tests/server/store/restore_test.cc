#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <tuple>

#include <gmock/gmock.h>

#include "server/store/sqlite/schema/schema.h"
#include "tests/server/store/backup_fixture.h"

namespace atlas {
namespace {

using ::testing::ElementsAre;

class RestoreTest : public BackupTest {
 protected:
  void BackUp(std::uint32_t keyframes = 3) {
    Fill(keyframes);
    const auto facts = WriteBackup();
    ASSERT_TRUE(facts.has_value()) << facts.error().message();
    facts_ = *facts;
  }
  void ExpectRefused(StatusCode code, bool replaces = false) {
    const auto names = NamesIn(restored().parent_path());
    const auto done = Restore(replaces);
    ASSERT_FALSE(done.has_value());
    EXPECT_EQ(done.error().code(), code) << done.error().message();
    EXPECT_EQ(NamesIn(restored().parent_path()), names);
  }

  static void Write(const std::filesystem::path& file, std::string_view text) {
    std::ofstream(file) << text;
  }
  static std::string Read(const std::filesystem::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  AtlasFacts facts_;
};

TEST_F(RestoreTest, IsWhatTheBackupIsInANewEpoch) {
  BackUp();
  const StoreIdentity before = store_->identity();
  ASSERT_TRUE(Put(Keyframe(4)).has_value()) << "what the backup lacks";
  const auto done = Restore();
  ASSERT_TRUE(done.has_value()) << done.error().message();
  EXPECT_EQ(done->backup.sha256, facts_.sha256);
  EXPECT_TRUE(done->kept.empty());
  EXPECT_EQ(RowsOf(restored()), RowsOf(backup()));
  OpenRestored();
  EXPECT_EQ(store_->identity().atlas_id, before.atlas_id);
  EXPECT_EQ(store_->identity().epoch, done->epoch);
  EXPECT_GT(done->epoch, before.epoch);
  EXPECT_EQ(store_->revision(), facts_.revision + 1 + kRevisionsLeftOut);
  EXPECT_EQ(store_->FindSession({"bus", "day"}).value()->last_sequence, 3U);
  const Status counted = store_->CheckCounters();
  EXPECT_TRUE(counted.ok()) << counted.message();
  const auto events = store_->ListEvents(0, 100);
  ASSERT_TRUE(events.has_value());
  EXPECT_EQ(events->back().kind, EventKind::kBackupRestored);
  EXPECT_EQ(events->back().subject, "monday");
  EXPECT_EQ(events->back().revision, done->revision);
  ASSERT_TRUE(Put(Keyframe(4)).has_value()) << "it goes on";
}

TEST_F(RestoreTest, WhatWasLostHasNoRevision) {
  BackUp();
  ASSERT_TRUE(Put(Keyframe(4)).has_value());
  const std::uint64_t lost = store_->revision();
  ASSERT_TRUE(Restore().has_value());
  OpenRestored();
  EXPECT_TRUE(store_->CheckRevision(facts_.revision).ok());
  EXPECT_EQ(store_->CheckRevision(lost).code(), StatusCode::kNotFound);
  const auto put = Put(Keyframe(4));
  ASSERT_TRUE(put.has_value());
  EXPECT_EQ(store_->CheckRevision(lost).code(), StatusCode::kNotFound);
  EXPECT_TRUE(store_->CheckRevision(put->revision).ok());
  EXPECT_EQ(store_->CheckRevision(put->revision + 1).code(), StatusCode::kInvalidArgument);
}

// What is kept outside of the database names a start and a revision of it: surveys, say.
TEST_F(RestoreTest, WhatWasKeptOfTheLostRevisionsIsNotOfItsLine) {
  BackUp();
  ASSERT_TRUE(Put(Keyframe(4)).has_value());
  const std::uint64_t lost = store_->revision();
  const AtlasStart start = store_->ReadLine()->starts.back();
  ASSERT_TRUE(Restore().has_value());
  OpenRestored();
  const AtlasLine line = store_->ReadLine().value();
  const auto kept = std::find(line.starts.begin(), line.starts.end(), start);
  ASSERT_NE(kept, line.starts.end());
  ASSERT_NE(kept + 1, line.starts.end()) << "the start would go on to the revision of now";
  EXPECT_EQ((kept + 1)->revision, facts_.revision);
  EXPECT_LT((kept + 1)->revision, lost);
}

TEST_F(RestoreTest, TwiceIsTwoEpochs) {
  BackUp();
  const auto first = Restore();
  const auto second = Restore(true);
  ASSERT_TRUE(first.has_value() && second.has_value());
  EXPECT_NE(first->epoch, second->epoch);
  OpenRestored();
  store_.reset();
  std::filesystem::remove(backup());
  std::filesystem::copy_file(restored(), backup());  // a restored atlas may be backed up
  const auto third = Restore(true);
  ASSERT_TRUE(third.has_value()) << third.error().message();
  EXPECT_GT(third->epoch, second->epoch);
}

TEST_F(RestoreTest, AnAtlasIsReplacedOnlyIfSaidSoAndKeptWithItsLog) {
  BackUp();
  ASSERT_TRUE(Put(Keyframe(4)).has_value());
  store_->Flush();
  std::filesystem::create_directories(restored().parent_path());
  for (const char* suffix : {"", "-wal"}) {  // as a daemon leaves them that was killed
    std::filesystem::copy_file(Database().string() + suffix, restored().string() + suffix);
  }
  ExpectRefused(StatusCode::kConflict);
  const auto done = Restore(true);
  ASSERT_TRUE(done.has_value()) << done.error().message();
  OpenRestored();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 3U) << "the log of another atlas was read";
  store_.reset();
  options_.directory = directory_ / "kept";
  std::filesystem::create_directories(options_.directory);
  for (const char* suffix : {"", "-wal"}) {
    std::filesystem::rename(done->kept.string() + suffix, Database().string() + suffix);
  }
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 4U);
}

TEST_F(RestoreTest, RefusesWhileSomebodyHasTheAtlas) {
  BackUp();
  ASSERT_TRUE(Restore().has_value());
  OpenRestored();
  ExpectRefused(StatusCode::kConflict, true);
  EXPECT_TRUE(Put(Keyframe(4)).has_value());
}

TEST_F(RestoreTest, RefusesWhatIsNoBackup) {
  ExpectRefused(StatusCode::kNotFound);
  std::filesystem::create_directory(backup());
  ExpectRefused(StatusCode::kInvalidArgument);
  std::filesystem::remove(backup());
  std::ofstream(backup()) << "no atlas";
  ExpectRefused(StatusCode::kInvalidData);
  std::filesystem::remove(backup());
  std::ofstream(backup()).flush();
  ExpectRefused(StatusCode::kInvalidData);
  std::filesystem::remove(backup());
  BackUp();
  std::ofstream(backup().string() + "-wal") << "a log";
  ExpectRefused(StatusCode::kInvalidArgument);
}

TEST_F(RestoreTest, RefusesAnotherSchema) {
  Fill(1);
  for (const std::int64_t version : {kStoreSchemaVersion + 1, kFirstReadableVersion - 1}) {
    Tamper("PRAGMA user_version = " + std::to_string(version));
    std::filesystem::copy_file(Database(), backup(),
                               std::filesystem::copy_options::overwrite_existing);
    ExpectRefused(StatusCode::kUnsupported);
  }
}

// Such as was made before the daemon was upgraded: it upgrades the atlas when it opens it.
TEST_F(RestoreTest, TakesABackupOfAnEarlierVersionWhoseRowsAreTodays) {
  Fill(3);
  Tamper("DROP INDEX quarantined_sessions; PRAGMA user_version = " +
         std::to_string(kFirstReadableVersion));
  std::filesystem::copy_file(Database(), backup(),
                             std::filesystem::copy_options::overwrite_existing);
  const auto done = Restore();
  ASSERT_TRUE(done.has_value()) << done.error().message();
  OpenRestored();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 3u);
  EXPECT_EQ(store_->ListEvents(0, 100)->back().kind, EventKind::kUpgraded);
}

TEST_F(RestoreTest, RefusesAnotherPlace) {
  BackUp();
  const auto code = [this](const std::filesystem::path& target) {
    const auto done = RestoreAtlas({backup(), target, true, Work()});
    return done ? StatusCode::kOk : done.error().code();
  };
  EXPECT_EQ(code(directory_ / "restored" / "tuesday.db"), StatusCode::kInvalidArgument);
  std::filesystem::rename(backup(), folder() / "atlas.db");
  const auto itself =
      RestoreAtlas({folder() / "atlas.db", folder() / ".." / "backups" / "atlas.db", true, Work()});
  ASSERT_FALSE(itself.has_value());
  EXPECT_EQ(itself.error().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(NamesIn(folder()), std::vector<std::string>{"atlas.db"});
}

TEST_F(RestoreTest, WithoutRoomNothingIsWritten) {
  BackUp();
  BackupWork work = Work();
  work.reserve_bytes = std::uint64_t{1} << 60U;
  const auto done = RestoreAtlas({backup(), restored(), false, work});
  ASSERT_FALSE(done.has_value());
  EXPECT_EQ(done.error().code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(NamesIn(restored().parent_path()), std::vector<std::string>{"lock"});
}

// The atlas that was there has another name, and the backup not yet its own.
TEST_F(RestoreTest, NoEmptyAtlasTakesThePlaceOfAnInterruptedRestore) {
  BackUp();
  ASSERT_TRUE(Restore().has_value());
  const auto partial = restored().string() + ".partial";
  std::filesystem::rename(restored(), partial);
  store_.reset();
  options_.directory = restored().parent_path();
  EXPECT_EQ(OpenCode(), StatusCode::kConflict);
  ASSERT_TRUE(Restore().has_value()) << "it may be restored again";
  std::ofstream(partial) << "a rest";
  OpenRestored();
  EXPECT_FALSE(std::filesystem::exists(partial));
}

// Between two of its names: what is left of the atlas follows it.
TEST_F(RestoreTest, TheLogOfAnAtlasThatWasMovedFollowsIt) {
  BackUp();
  ASSERT_TRUE(Restore().has_value());
  Write(restored().string() + ".replaced-1", "an older one");
  std::filesystem::rename(restored(), restored().string() + ".replaced-2");
  Write(restored().string() + "-wal", "its log");
  Write(restored().string() + ".partial", "half a copy");
  const auto done = Restore();
  ASSERT_TRUE(done.has_value()) << done.error().message();
  EXPECT_EQ(done->kept.filename(), "atlas.db.replaced-2");
  EXPECT_EQ(Read(done->kept.string() + "-wal"), "its log");
  EXPECT_FALSE(std::filesystem::exists(restored().string() + "-wal"));
}

// All of it was moved, and the copy has not got its name.
TEST_F(RestoreTest, WhatAnInterruptedRestoreMovedIsNamed) {
  BackUp();
  ASSERT_TRUE(Restore().has_value());
  std::filesystem::rename(restored(), restored().string() + ".replaced-3");
  Write(restored().string() + ".partial", "half a copy");
  const auto done = Restore();
  ASSERT_TRUE(done.has_value()) << done.error().message();
  EXPECT_EQ(done->kept, restored().string() + ".replaced-3");
  EXPECT_TRUE(done->left.empty());
  std::filesystem::remove(restored());
  const auto anew = Restore();
  ASSERT_TRUE(anew.has_value()) << anew.error().message();
  EXPECT_EQ(anew->kept, "") << "nobody was interrupted";
}

// Of another atlas than the one that was kept last: that one has its own log, or nobody was
// interrupted.
TEST_F(RestoreTest, NothingThatIsKeptIsWrittenOver) {
  BackUp();
  for (const bool was_interrupted : {false, true}) {
    SCOPED_TRACE(was_interrupted);
    std::filesystem::remove_all(restored().parent_path());
    ASSERT_TRUE(Restore().has_value());
    const std::string kept = restored().string() + ".replaced-1";
    std::filesystem::rename(restored(), kept);
    Write(restored().string() + "-wal", "a log of today");
    Write(restored().string() + "-revision", "a note of today");
    if (was_interrupted) {
      Write(kept + "-wal", "its log");
      Write(restored().string() + ".partial", "half a copy");
    }
    const auto done = Restore();
    ASSERT_TRUE(done.has_value()) << done.error().message();
    EXPECT_EQ(done->kept, "") << "no database was";
    ASSERT_THAT(done->left, ElementsAre(restored().string() + ".replaced-2-wal",
                                        restored().string() + ".replaced-2-revision"));
    EXPECT_EQ(Read(done->left[0]), "a log of today");
    EXPECT_EQ(Read(done->left[1]), "a note of today");
    EXPECT_EQ(std::filesystem::exists(kept + "-wal"), was_interrupted);
    EXPECT_FALSE(std::filesystem::exists(kept + "-revision"));
    std::filesystem::remove(restored());
    Write(restored().string() + "-wal", "a log of tomorrow");
    const auto again = Restore();
    ASSERT_TRUE(again.has_value()) << again.error().message();
    EXPECT_THAT(again->left, ElementsAre(restored().string() + ".replaced-3-wal"))
        << "a log alone takes a number, too";
    EXPECT_EQ(Read(done->left[0]), "a log of today");
  }
}

// The atlas of today was moved away by hand, a copy was left by an earlier restore, and the one
// that was kept last is another one: its pages and those of the log would become one.
TEST_F(RestoreTest, ALogFollowsTheAtlasThatItGoesOnFromAlone) {
  BackUp();
  ASSERT_TRUE(Restore().has_value());
  const std::string atlas = restored().string();
  std::string older;
  std::string older_log;
  for (const std::uint32_t sequence : {50U, 51U, 52U}) {
    OpenRestored();
    ASSERT_TRUE(Put(Keyframe(sequence)));
    if (sequence == 50) {
      older_log = Read(atlas + "-wal");
      store_.reset();
      older = Read(restored());
    }
  }
  const std::string own = Read(restored());
  const std::string own_log = Read(atlas + "-wal");
  const std::string note = Read(atlas + "-revision");
  store_.reset();
  struct Case {
    const char* what;
    std::string kept;
    std::string log;
    std::string noted_at;
    bool follows;
  };
  const std::string kept_note = ".replaced-1-revision";
  for (const Case& is : {Case{"its own", own, own_log, "-revision", true},
                         Case{"its own, and the note was moved", own, own_log, kept_note, true},
                         Case{"its own, and nothing says so", own, own_log, "", false},
                         Case{"of an older run", own, older_log, "-revision", false},
                         Case{"of an older run, the note moved", own, older_log, kept_note, false},
                         Case{"of a newer run", older, own_log, "-revision", false},
                         Case{"nothing tells", older, own_log, "", false}}) {
    SCOPED_TRACE(is.what);
    std::filesystem::remove_all(restored().parent_path());
    std::filesystem::create_directories(restored().parent_path());
    Write(atlas + ".replaced-1", is.kept);
    Write(atlas + "-wal", is.log);
    if (!is.noted_at.empty()) {
      Write(atlas + is.noted_at, note);
    }
    Write(atlas + ".partial", "half a copy");
    const auto done = Restore();
    ASSERT_TRUE(done.has_value()) << done.error().message();
    EXPECT_EQ(done->kept, is.follows ? atlas + ".replaced-1" : "");
    EXPECT_EQ(done->left.empty(), is.follows);
    EXPECT_EQ(Read(atlas + (is.follows ? ".replaced-1-wal" : ".replaced-2-wal")), is.log);
    EXPECT_EQ(std::filesystem::exists(atlas + ".replaced-1-wal"), is.follows);
    EXPECT_EQ(Read(atlas + ".replaced-1"), is.kept);
  }
}

// The daemon is still told that the atlas has another name.
TEST_F(RestoreTest, OneThatWasInterruptedMayFailAndBeRunAgain) {
  BackUp();
  ASSERT_TRUE(Restore().has_value());
  std::filesystem::rename(restored(), restored().string() + ".replaced-1");
  Write(restored().string() + ".partial", "half a copy");
  BackupWork work = Work();
  work.reserve_bytes = std::uint64_t{1} << 60U;
  ASSERT_FALSE(RestoreAtlas({backup(), restored(), false, work}).has_value());
  store_.reset();
  options_.directory = restored().parent_path();
  EXPECT_EQ(OpenCode(), StatusCode::kConflict);
  EXPECT_FALSE(std::filesystem::exists(restored())) << "an empty atlas has its place";
  ASSERT_TRUE(Restore().has_value());
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 3U);
}

}  // namespace
}  // namespace atlas
