// A log or a database that was removed, cut off or replaced by an older copy while the daemon was
// away: a shorter history that nothing in it contradicts. The note beside it does.
#include <chrono>

#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/log_damage.h"
#include "tests/server/store/missing_commits_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPage = 8'192;
constexpr std::size_t kFrame = 24 + kPage;
constexpr std::size_t kLogHeader = 32;

TEST_F(MissingCommitsTest, ACommitIsNotedBeforeItIsAcknowledged) {
  Open();
  EXPECT_EQ(ReadRevisionNote(Note())->revision, 0U);
  for (std::uint32_t i = 0; i < 4; ++i) {
    std::uint64_t noted = 0;
    const auto put = Await<PutKeyframeResult>([&](auto done) {
      store_->PutKeyframe(Keyframe(i), [&, done](Result<PutKeyframeResult> result) {
        noted = ReadRevisionNote(Note())->revision;
        done(std::move(result));
      });
    });
    EXPECT_EQ(noted, put->revision);
  }
  EXPECT_EQ(ReadRevisionNote(Note())->atlas_id, store_->identity().atlas_id);
  EXPECT_EQ(ReadRevisionNote(Note())->epoch, 1U);
}

TEST_F(MissingCommitsTest, AKillLosesNothing) {
  Open();
  PutMany(0, 5);
  const Files killed = Look();
  PutThere(killed);
  Open();
  ExpectNothingMissing();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 5U);
  EXPECT_EQ(store_->identity().epoch, 1U);
}

TEST_F(MissingCommitsTest, ALogThatIsGone) {
  Open();
  PutMany(0, 2);
  Open();
  PutMany(2, 3);
  const NotedRevision lost = *ReadRevisionNote(Note());
  Files killed = Look();
  killed.erase("atlas.db-wal");
  PutThere(killed);
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 2U);
  ExpectNoticed(lost);
}

TEST_F(MissingCommitsTest, ALogThatWasCutAnywhere) {
  Open();
  PutMany(0, 6);
  const NotedRevision lost = *ReadRevisionNote(Note());
  const Files killed = Look();
  const std::size_t frames = (killed.at("atlas.db-wal").size() - kLogHeader) / kFrame;
  std::size_t noticed = 0;
  for (std::size_t left = 0; left <= frames; ++left) {
    SCOPED_TRACE(left);
    for (const std::size_t more : {std::size_t{0}, kFrame / 2}) {
      Files cut = killed;
      cut["atlas.db-wal"].resize(
          std::min(kLogHeader + left * kFrame + more, cut["atlas.db-wal"].size()));
      PutThere(cut);
      Open();
      const bool is_whole = store_->ReadCounts()->keyframes == 6;
      EXPECT_EQ(told_.empty(), is_whole);
      EXPECT_EQ(Losses(), is_whole ? 0U : 1U);
      EXPECT_EQ(store_->CheckRevision(lost.revision).ok(), is_whole);
      noticed += is_whole ? 0 : 1;
    }
  }
  EXPECT_GE(noticed, 12U);
}

TEST_F(MissingCommitsTest, AnOlderCopyOfTheDatabase) {
  Open();
  PutMany(0, 2);
  store_.reset();
  const Bytes older = ReadFile(Database());
  Open();
  PutMany(2, 3);
  const NotedRevision lost = *ReadRevisionNote(Note());
  store_.reset();
  WriteFile(Database(), older);
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 2U);
  ExpectNoticed(lost);
}

TEST_F(MissingCommitsTest, AnOlderCopyFromBeforeARestore) {
  Fill(3);
  ASSERT_TRUE(WriteBackup());
  ASSERT_TRUE(Restore());
  OpenRestored();
  store_.reset();
  const Bytes first = ReadFile(Database());
  fs::remove(backup());
  Open();
  ASSERT_TRUE(WriteBackup());
  store_.reset();
  ASSERT_TRUE(Restore(true));
  Open();
  PutMany(10, 3);
  const NotedRevision lost = *ReadRevisionNote(Note());
  ASSERT_EQ(LineOf(lost.revision), 2U);
  store_.reset();
  WriteFile(Database(), first);
  Open();
  ExpectNoticed(lost);
  EXPECT_EQ(LineOf(store_->revision()), 3U);
}

TEST_F(MissingCommitsTest, ARestoreIsFine) {
  Fill(3);
  ASSERT_TRUE(WriteBackup());
  ASSERT_TRUE(Restore());
  OpenRestored();
  PutMany(10, 5);
  const NotedRevision replaced = *ReadRevisionNote(Note());
  store_.reset();
  const auto again = Restore(true);
  ASSERT_TRUE(again) << again.error().message();
  EXPECT_FALSE(fs::exists(Note())) << "it is of the atlas that was replaced";
  EXPECT_EQ(ReadRevisionNote(NoteOf(again->kept))->revision, replaced.revision);
  Open();
  ExpectNothingMissing();
  EXPECT_GT(LineOf(store_->revision()), LineOf(replaced.revision))
      << "a number that the first one gave is given again";
  // Who wants the replaced one back gives it its name, with its note or without.
  for (const bool has_note : {false, true}) {
    store_.reset();
    fs::remove(Note());
    fs::copy_file(again->kept, Database(), fs::copy_options::overwrite_existing);
    if (has_note) {
      fs::copy_file(NoteOf(again->kept), Note());
    }
    Open();
    ExpectNothingMissing();
    EXPECT_EQ(store_->identity().epoch, replaced.epoch);
  }
}

// Behind a power cut, say.
TEST_F(MissingCommitsTest, ANoteThatIsOldOrNotWholeSaysNothing) {
  Open();
  PutMany(0, 2);
  const Bytes old = ReadFile(Note());
  PutMany(2, 3);
  store_.reset();
  Files closed = Look();
  const Bytes note = closed["atlas.db-revision"];
  const std::uint64_t revision = ReadRevisionNote(Note())->revision;
  const auto expect_silence = [&](const Bytes& bytes) {
    closed["atlas.db-revision"] = bytes;
    PutThere(closed);
    Open();
    ExpectNothingMissing();
    EXPECT_EQ(ReadRevisionNote(Note())->revision, revision) << "and is written anew";
  };
  expect_silence(old);
  expect_silence({});
  expect_silence(Bytes(note.size(), 0));
  expect_silence(Bytes(note.begin(), note.begin() + 20));
  for (std::size_t byte = 0; byte < note.size(); ++byte) {
    Bytes turned = note;
    turned[byte] ^= 1U << (byte % 8);
    expect_silence(turned);
  }
}

TEST_F(MissingCommitsTest, ANoteOfAnotherAtlasSaysNothing) {
  Open();
  PutMany(0, 5);
  const Bytes note = ReadFile(Note());
  store_.reset();
  fs::remove_all(options_.directory);
  options_.new_atlas_id = {9, 9, 9};
  Open();
  store_.reset();
  WriteFile(Note(), note);
  Open();
  ExpectNothingMissing();
  EXPECT_EQ(ReadRevisionNote(Note())->atlas_id, store_->identity().atlas_id);
}

TEST_F(MissingCommitsTest, NoNewAtlasTakesThePlaceOfOneThatIsGone) {
  Open();
  PutMany(0, 2);
  store_.reset();
  const Bytes atlas = ReadFile(Database());
  fs::remove(Database());
  EXPECT_EQ(OpenCode(), StatusCode::kConflict);
  EXPECT_FALSE(fs::exists(Database()));
  WriteFile(Database(), atlas);
  Open();
  ExpectNothingMissing();
  store_.reset();
  fs::remove(Database());
  fs::remove(Note());
  Open();
  EXPECT_EQ(store_->revision(), 0U);
}

// As a kill in the middle of copying the log leaves the database, whose log went then.
TEST_F(MissingCommitsTest, WhatIsLeftIsNoAtlas) {
  Open();
  PutMany(0, 3);
  const std::size_t counters =
      kPage * static_cast<std::size_t>(
                  Connection({Database(), DatabaseOptions::Mode::kReadOnly})
                      .Ask("SELECT rootpage - 1 FROM sqlite_master WHERE name = 'counters'"));
  store_.reset();
  const Files before = Look();
  Open();
  PutMany(3, 3);
  store_.reset();
  Files mixed = Look();
  std::copy_n(before.at("atlas.db").begin() + static_cast<std::ptrdiff_t>(counters), kPage,
              mixed.at("atlas.db").begin() + static_cast<std::ptrdiff_t>(counters));
  PutThere(mixed);
  const auto refused = OpenSqliteStore(options_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(refused.error().message().find("what is left is no atlas"), std::string::npos)
      << refused.error().message();
  EXPECT_NE(refused.error().message().find("nothing was changed"), std::string::npos)
      << refused.error().message();
  EXPECT_EQ(Look(), mixed) << "nothing was changed";
}

// The end of the log was damaged, and a start of the system behind it lets that pass for what a
// power cut leaves; its pages are in the database, but for that of the revision.
TEST_F(MissingCommitsTest, WhatIsLeftBesideATornEndIsNoAtlas) {
  const auto tiles_of = [](std::int32_t keyframe) {
    std::vector<TileId> tiles;
    for (std::int32_t x = 0; x < 150; ++x) {
      tiles.push_back({0, 150 * keyframe + x, 0});
    }
    return tiles;
  };
  Open();
  for (std::uint32_t i = 0; i < 10; ++i) {
    ASSERT_TRUE(Put(MakeKeyframe(i, tiles_of(static_cast<std::int32_t>(i)))));
  }
  store_.reset();
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(10, {{0, 0, 0}})));
  ASSERT_TRUE(Update({{{{"bus", "day"}, 5}, PoseAt(5'000'000), tiles_of(5)}}));
  Files torn = Look();
  Connection copier({Database(), DatabaseOptions::Mode::kReadWrite});
  ASSERT_GT(copier.CopyLog().value_or(0), 0);
  const auto counters = static_cast<std::ptrdiff_t>(
      kPage * static_cast<std::size_t>(
                  copier.Ask("SELECT rootpage - 1 FROM sqlite_master WHERE name = 'counters'")));
  Bytes copied = ReadFile(Database());
  std::copy_n(torn.at("atlas.db").begin() + counters, kPage, copied.begin() + counters);
  torn["atlas.db"] = copied;
  Bytes& log = torn["atlas.db-wal"];
  log[log.size() - kFrame - 100] ^= 0x18;  // not the last of that commit
  log[log.size() - kFrame - 99] ^= 0x21;
  PutThere(torn);
  fs::last_write_time(Log(), std::chrono::file_clock::from_sys(std::chrono::sys_seconds()));
  ASSERT_EQ(FindLogDamage(Log(), false)->lost_commits, 0U);
  ASSERT_TRUE(FindLogDamage(Log(), false)->has_rest);
  const auto refused = OpenSqliteStore(options_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(refused.error().message().find("what is left is no atlas"), std::string::npos)
      << refused.error().message();
  EXPECT_TRUE(Look() == torn) << "something was changed";
}

}  // namespace
}  // namespace atlas
