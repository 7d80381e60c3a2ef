// Bits that turn in the log of a daemon that was killed: one is turned back; what SQLite drops
// behind more of them without a word, the daemon notices, tells, and goes on from under another
// epoch.
#include "server/store/sqlite/connection/log_damage.h"

#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <random>

#include <signal.h>
#include <sys/resource.h>

#include "server/store/event_types.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/log_renewal.h"
#include "server/store/sqlite/damaged_log.h"
#include "tests/core/support/test_scale.h"
#include "tests/server/store/faulty_vfs.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr int kCommits = 12;
constexpr int kOld = 40;
constexpr std::size_t kFrameBytes = 24 + 8'192;

Bytes ReadFile(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void WriteFile(const fs::path& path, const Bytes& bytes) {
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

class LogDamageTest : public StoreTest {
 protected:
  // What a kill leaves of a store that has a log, and of how many rows.
  // `copied`: so many commits are in the database, too, as the log copier leaves them.
  void Live(std::uint32_t copied = 0) {
    store_.reset();
    fs::remove_all(options_.directory);
    Open();
    // What is there already has pages all over the database: each commit changes some of them.
    all_ = kCommits + (copied > 0 ? kOld : 0);
    for (std::uint32_t i = 0; copied > 0 && i < kOld; ++i) {
      ASSERT_TRUE(Put(MakeKeyframe(100 + i, TilesOf(i))));
    }
    Open();
    const DatabaseOptions database{options_.directory / "atlas.db",
                                   DatabaseOptions::Mode::kReadWrite};
    std::optional<Connection> reader;
    for (std::uint32_t i = 0; i < kCommits; ++i) {
      ASSERT_TRUE(Put(MakeKeyframe(i, TilesOf(i))));
      if (i + 1 == copied) {  // what it reads is not written over
        reader.emplace(database);
        reader->Execute("BEGIN");
        reader->Ask("SELECT count(*) FROM keyframes");
      }
    }
    if (reader) {
      ASSERT_GT(Connection(database).CopyLog().value_or(0), 0);
    }
    before_ = store_->revision();
    for (const char* const name : {"atlas.db", "atlas.db-wal"}) {
      killed_[name] = ReadFile(options_.directory / name);
    }
    ASSERT_GT(killed_["atlas.db-wal"].size(), 32u);
    store_.reset();
  }
  // So many that commits fill pages of their own.
  static std::vector<TileId> TilesOf(std::uint32_t keyframe) {
    std::vector<TileId> tiles;
    for (std::int32_t x = 0; x < 150; ++x) {
      tiles.push_back({0, 150 * static_cast<std::int32_t>(keyframe) + x, 0});
    }
    return tiles;
  }
  // As it was killed, but for bits of the log: one byte's, and the next one's where that is to be
  // more than anybody can turn back.
  void Revive(std::size_t byte, std::uint8_t mask, std::uint8_t next_mask = 0) {
    store_.reset();
    fs::remove_all(options_.directory);
    fs::create_directories(options_.directory);
    for (const auto& [name, bytes] : killed_) {
      WriteFile(options_.directory / name, bytes);
    }
    Bytes log = killed_["atlas.db-wal"];
    log[byte] ^= mask;
    log[byte + 1] ^= next_mask;
    WriteFile(Log(), log);
  }
  // In the page of a frame, counted from 0.
  static std::size_t ByteOf(std::size_t frame) { return 32 + frame * kFrameBytes + 24 + 100; }
  std::size_t Frames() { return (killed_["atlas.db-wal"].size() - 32) / kFrameBytes; }
  fs::path Log() const { return options_.directory / "atlas.db-wal"; }
  std::ptrdiff_t Copies() const {
    return std::count_if(fs::directory_iterator(options_.directory), {}, [](const auto& entry) {
      return entry.path().string().find(".damaged-") != std::string::npos;
    });
  }
  std::size_t Keyframes() { return store_->ListKeyframeIds(0, 100).value().size(); }
  bool IsToldOfLoss() {
    const auto events = store_->ListEvents(0, 100).value();
    return std::any_of(events.begin(), events.end(),
                       [](const Event& event) { return event.kind == EventKind::kLogDamaged; });
  }

  std::map<std::string, Bytes> killed_;
  std::uint64_t before_ = 0;
  std::size_t all_ = kCommits;  // keyframes
};

// Most are turned back; where two would do as well, it is told what is lost, or the atlas refused.
TEST_F(LogDamageTest, NoBitLosesWhatWasAcknowledgedInSilence) {
  for (const std::uint32_t copied : {0u, 8u}) {
    Live(copied);
    std::mt19937 random(5);
    const std::size_t bytes = killed_["atlas.db-wal"].size();
    std::uniform_int_distribution<std::size_t> byte_of(0, bytes - 2);
    std::size_t mended = 0;
    const std::uint32_t flips = testing::Scaled(200);
    for (std::uint32_t i = 0; i < flips; ++i) {
      const std::size_t byte = i < 56 ? i : byte_of(random);  // the headers of log and first frame
      SCOPED_TRACE(byte);
      Revive(byte, static_cast<std::uint8_t>(1u << (random() % 8)));
      std::string told;
      options_.on_damaged_log = [&told](const std::string& what) {
        told = what;
      };
      auto store = OpenSqliteStore(options_);
      if (!store) {
        EXPECT_EQ(store.error().code(), StatusCode::kInvalidData);
        EXPECT_EQ(copied, 8u) << store.error().message();
        continue;
      }
      store_ = *std::move(store);
      const bool is_whole = Keyframes() == all_;
      const bool is_mended = told.find("nothing is lost") != std::string::npos;
      mended += is_mended ? 1 : 0;
      EXPECT_EQ(told.empty() || is_mended, is_whole) << told;
      EXPECT_EQ(IsToldOfLoss(), !is_whole);
      EXPECT_EQ(store_->identity().epoch == 1, is_whole);
      EXPECT_TRUE(store_->CheckCounters().ok());
    }
    EXPECT_GT(mended, flips / 3);
  }
}

TEST_F(LogDamageTest, BitsOfSeveralFramesAreTurnedBack) {
  Live();
  Revive(ByteOf(1), 4);
  Bytes log = ReadFile(Log());
  log[ByteOf(Frames() / 2)] ^= 1;
  log[ByteOf(Frames() - 1) - 110] ^= 0x80;  // of its header
  WriteFile(Log(), log);
  Open();
  EXPECT_EQ(Keyframes(), std::size_t{kCommits});
  EXPECT_EQ(ReadFile(Log().string() + ".damaged-1"), log);
}

TEST_F(LogDamageTest, WhatCannotBeTurnedBackIsTold) {
  Live();
  std::size_t lossy = 0;
  for (std::size_t frame = 0; frame + 1 < Frames(); frame += 3) {
    SCOPED_TRACE(frame);
    Revive(ByteOf(frame), 0x18, 0x21);
    std::string told;
    options_.on_damaged_log = [&told](const std::string& what) {
      told = what;
    };
    Open();
    ASSERT_NE(store_, nullptr);
    const bool is_whole = Keyframes() == all_;
    EXPECT_EQ(told.empty(), is_whole);
    EXPECT_EQ(IsToldOfLoss(), !is_whole);
    EXPECT_EQ(store_->identity().epoch == 1, is_whole);
    EXPECT_TRUE(store_->CheckCounters().ok());
    if (!is_whole) {
      ++lossy;
      EXPECT_EQ(store_->CheckRevision(before_).code(), StatusCode::kNotFound);
      EXPECT_GT(store_->revision(), before_);
      EXPECT_TRUE(fs::exists(Log().string() + ".damaged-1"));
    }
  }
  EXPECT_GT(lossy, Frames() / 6);
}

// Else SQLite would put pages of the log's beginning over newer ones.
TEST_F(LogDamageTest, AnAtlasOfPagesOfDifferentCommitsIsRefusedAsItIs) {
  Live(8);
  std::size_t refused = 0;
  for (std::size_t frame = 0; frame + 1 < Frames(); frame += 7) {
    SCOPED_TRACE(frame);
    Revive(ByteOf(frame), 0x18, 0x21);
    const Bytes log = ReadFile(Log());
    auto store = OpenSqliteStore(options_);
    if (store) {
      EXPECT_TRUE((*store)->CheckCounters().ok());
      continue;
    }
    ++refused;
    EXPECT_EQ(store.error().code(), StatusCode::kInvalidData);
    EXPECT_NE(store.error().message().find("restore a backup"), std::string::npos)
        << store.error().message();
    EXPECT_EQ(ReadFile(Log()), log);
    EXPECT_EQ(ReadFile(options_.directory / "atlas.db"), killed_["atlas.db"]);
    EXPECT_FALSE(fs::exists(Log().string() + ".damaged-1"));
  }
  EXPECT_GT(refused, 0u);
}

// The log stays as it is, and who looks for help starts again.
TEST_F(LogDamageTest, RefusedStartsKeepOneCopy) {
  Live();
  constexpr std::size_t kVersionAt = 63;  // of the schema, in the header of the database
  killed_["atlas.db"][kVersionAt] = 99;
  Revive(ByteOf(20), 0x0f, 0x33);
  const Bytes log = ReadFile(Log());
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(OpenCode(), StatusCode::kUnsupported);
    EXPECT_EQ(ReadFile(Log()), log);
  }
  EXPECT_EQ(Copies(), 1);
  Revive(ByteOf(20), 0x0f, 0x36);
  WriteFile(Log().string() + ".damaged-1", log);
  ASSERT_EQ(OpenCode(), StatusCode::kUnsupported);
  EXPECT_EQ(ReadFile(Log().string() + ".damaged-1"), log) << "of another damage";
  EXPECT_EQ(ReadFile(Log().string() + ".damaged-2"), ReadFile(Log()));
}

TEST_F(LogDamageTest, NoPartOfACopyIsLeftOnAFullDisk) {
  Live();
  Revive(ByteOf(20), 0x0f, 0x33);
  ::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit full{4'096, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &full), 0);
  const auto mended = MendLog(Log());
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  ASSERT_FALSE(mended);
  EXPECT_EQ(mended.error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(Copies(), 0);
}

TEST_F(LogDamageTest, WhatWasLostIsNotLostOnceMore) {
  Live();
  Revive(ByteOf(Frames() / 2), 0x18, 0x21);
  Open();
  const std::uint64_t epoch = store_->identity().epoch;
  EXPECT_GT(epoch, 1u);
  for (std::uint32_t i = 0; i < kCommits; ++i) {
    ASSERT_TRUE(Put(MakeKeyframe(i, {{0, static_cast<std::int32_t>(i), 0}})));
  }
  Open();
  EXPECT_EQ(store_->identity().epoch, epoch) << "the rest of the damaged log is gone";
  EXPECT_EQ(Keyframes(), std::size_t{kCommits});
  EXPECT_EQ(store_->CheckRevision(before_).code(), StatusCode::kNotFound) << "for good";
}

// Killed, and nothing else.
// Whoever reads the database meanwhile keeps the log from being emptied: it is cut.
TEST_F(LogDamageTest, NothingIsWrittenBeforeARestThatIsRead) {
  Live();
  Revive(ByteOf(Frames() / 2), 0x10, 0x20);
  ASSERT_TRUE(FindLogDamage(Log(), true)->has_rest);
  const fs::path database = options_.directory / "atlas.db";
  Connection reader({database, DatabaseOptions::Mode::kReadOnly, 1'024, 0});
  reader.Execute("BEGIN");
  const std::int64_t seen = reader.Ask("SELECT count(*) FROM keyframes");
  Connection writer({database, DatabaseOptions::Mode::kReadWrite, 1'024, 0});
  DropRest(writer, Log());
  EXPECT_GT(fs::file_size(Log()), 0U) << "nobody read it";
  EXPECT_FALSE(FindLogDamage(Log(), true)->has_rest);
  EXPECT_EQ(FindLogDamage(Log(), true)->lost_commits, 0U);
  writer.Execute("PRAGMA user_version = 0");
  EXPECT_FALSE(FindLogDamage(Log(), true)->has_rest);
  EXPECT_EQ(reader.Ask("SELECT count(*) FROM keyframes"), seen);
  reader.Execute("COMMIT");
  EXPECT_EQ(reader.Ask("SELECT count(*) FROM keyframes"), seen);
}

// A start that ends at any of its calls, with no note beside the database: the next one tells.
TEST_F(LogDamageTest, AStartThatIsCutShortLosesNothingInSilence) {
  FaultyVfs vfs;
  Live();
  bool has_failed = true;
  std::uint64_t number = 1;
  for (; has_failed; number += testing::Stride(3)) {
    SCOPED_TRACE(number);
    Revive(ByteOf(Frames() / 2), 0x10, 0x20);
    vfs.BeginAnew();
    vfs.FailAt(number, FaultyVfs::Calls::kAll, FaultyVfs::Until::kHealed);
    static_cast<void>(OpenCode());
    has_failed = vfs.Heal();
    fs::remove(options_.directory / "atlas.db-revision");
    Open();
    ASSERT_TRUE(IsToldOfLoss());
    ASSERT_LT(Keyframes(), all_);
  }
  EXPECT_GT(number, 10U);
  store_.reset();
}

TEST_F(LogDamageTest, AWholeLogIsNoLoss) {
  Live();
  Revive(0, 0);
  WriteFile(Log(), killed_["atlas.db-wal"]);
  Open();
  EXPECT_EQ(store_->identity().epoch, 1u);
  EXPECT_EQ(Keyframes(), std::size_t{kCommits});
  EXPECT_FALSE(IsToldOfLoss());
}

// Its header was written and its page not, or in part, when the daemon was killed: nobody was told
// of that commit.
TEST_F(LogDamageTest, AFrameThatAKillToreIsNoLoss) {
  Live();
  for (const std::size_t unwritten : {8'192u, 4'096u, 100u, 2u}) {
    SCOPED_TRACE(unwritten);
    Revive(0, 0);
    Bytes log = killed_["atlas.db-wal"];
    std::fill(log.end() - static_cast<std::ptrdiff_t>(unwritten), log.end(), std::uint8_t{0x5A});
    WriteFile(Log(), log);
    const auto found = FindLogDamage(Log(), true);
    EXPECT_EQ(found->lost_commits, 0u);
    EXPECT_TRUE(found->has_rest);
    Open();
    EXPECT_EQ(store_->identity().epoch, 1u);
    EXPECT_EQ(Keyframes(), std::size_t{kCommits - 1});
    EXPECT_FALSE(IsToldOfLoss());
  }
}

// Of what was being written when the power failed nobody knows more than its last commit.
TEST_F(LogDamageTest, ATornEndAfterAPowerCutIsNoLoss) {
  Live();
  Revive(ByteOf(Frames() - 2), 0x18, 0x21);  // not the last of that commit
  EXPECT_EQ(FindLogDamage(Log(), true)->lost_commits, 1u);
  EXPECT_EQ(FindLogDamage(Log(), false)->lost_commits, 0u);
  EXPECT_TRUE(FindLogDamage(Log(), false)->has_rest);
  EXPECT_TRUE(HasRunSince(Log()));
  fs::last_write_time(Log(), std::chrono::file_clock::from_sys(std::chrono::sys_seconds()));
  EXPECT_FALSE(HasRunSince(Log()));
  ASSERT_TRUE(RenewLog(Database()).ok());
  EXPECT_FALSE(HasRunSince(Log())) << "a start that went no further than that is no run";
  Open();
  EXPECT_EQ(store_->identity().epoch, 1u);
  EXPECT_EQ(Keyframes(), std::size_t{kCommits - 1});
  ASSERT_TRUE(Put(MakeKeyframe(kCommits - 1, {{0, 1, 0}})));
  Revive(ByteOf(Frames() / 2), 0x18, 0x21);
  fs::last_write_time(Log(), std::chrono::file_clock::from_sys(std::chrono::sys_seconds()));
  Open();
  EXPECT_GT(store_->identity().epoch, 1u) << "more than one commit: that was on disk";
}

TEST_F(LogDamageTest, NoLogAndAnEmptyOneAreNone) {
  EXPECT_EQ(FindLogDamage(directory_ / "none", true)->lost_commits, 0u);
  WriteFile(directory_ / "empty", {});
  EXPECT_FALSE(FindLogDamage(directory_ / "empty", true)->has_rest);
  WriteFile(directory_ / "short", Bytes(100, 0xFF));
  EXPECT_FALSE(FindLogDamage(directory_ / "short", true)->has_rest);
}

}  // namespace
}  // namespace atlas
