// Bits that turn in the log of a daemon that was killed: what SQLite drops without a word, the
// daemon notices, tells, and goes on from under another epoch.
#include "server/store/sqlite/connection/log_damage.h"

#include <chrono>
#include <fstream>
#include <iterator>
#include <random>

#include "server/store/event_types.h"
#include "tests/core/support/test_scale.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr int kCommits = 12;

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
  void Live() {
    Open();
    for (std::uint32_t i = 0; i < kCommits; ++i) {
      ASSERT_TRUE(Put(MakeKeyframe(i, {{0, static_cast<std::int32_t>(i), 0}})));
    }
    before_ = store_->revision();
    for (const char* const name : {"atlas.db", "atlas.db-wal"}) {
      killed_[name] = ReadFile(options_.directory / name);
    }
    ASSERT_GT(killed_["atlas.db-wal"].size(), 32u);
    store_.reset();
  }
  // As it was killed, but for one bit of the log.
  void Revive(std::size_t byte, int bit) {
    store_.reset();
    fs::remove_all(options_.directory);
    fs::create_directories(options_.directory);
    for (const auto& [name, bytes] : killed_) {
      WriteFile(options_.directory / name, bytes);
    }
    Bytes log = killed_["atlas.db-wal"];
    log[byte] ^= static_cast<std::uint8_t>(1 << bit);
    WriteFile(Log(), log);
  }
  fs::path Log() const { return options_.directory / "atlas.db-wal"; }
  std::size_t Keyframes() { return store_->ListKeyframeIds(0, 100).value().size(); }
  bool IsToldOfLoss() {
    const auto events = store_->ListEvents(0, 100).value();
    return std::any_of(events.begin(), events.end(),
                       [](const Event& event) { return event.kind == EventKind::kLogDamaged; });
  }

  std::map<std::string, Bytes> killed_;
  std::uint64_t before_ = 0;
};

TEST_F(LogDamageTest, NoBitLosesWhatWasAcknowledgedInSilence) {
  Live();
  std::mt19937 random(5);
  const std::size_t bytes = killed_["atlas.db-wal"].size();
  std::uniform_int_distribution<std::size_t> byte_of(0, bytes - 1);
  std::size_t lossy = 0;
  const std::uint32_t flips = testing::Scaled(200);
  for (std::uint32_t i = 0; i < flips; ++i) {
    const std::size_t byte = i < 56 ? i : byte_of(random);  // the headers of log and first frame
    SCOPED_TRACE(byte);
    Revive(byte, static_cast<int>(random() % 8));
    std::string told;
    options_.on_damaged_log = [&told](const std::string& what) {
      told = what;
    };
    Open();
    ASSERT_NE(store_, nullptr);
    const bool is_whole = Keyframes() == kCommits;
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
  EXPECT_GT(lossy, flips / 2);
}

TEST_F(LogDamageTest, WhatWasLostIsNotLostOnceMore) {
  Live();
  Revive(killed_["atlas.db-wal"].size() / 2, 3);
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
  const std::size_t frame = 24 + 8'192;
  Revive(killed_["atlas.db-wal"].size() - frame / 2, 1);
  EXPECT_EQ(FindLogDamage(Log(), true)->lost_commits, 1u);
  EXPECT_EQ(FindLogDamage(Log(), false)->lost_commits, 0u);
  EXPECT_TRUE(FindLogDamage(Log(), false)->has_rest);
  EXPECT_TRUE(HasRunSince(Log()));
  fs::last_write_time(Log(), std::chrono::file_clock::from_sys(std::chrono::sys_seconds()));
  EXPECT_FALSE(HasRunSince(Log()));
  Open();
  EXPECT_EQ(store_->identity().epoch, 1u);
  EXPECT_EQ(Keyframes(), std::size_t{kCommits - 1});
  ASSERT_TRUE(Put(MakeKeyframe(kCommits - 1, {{0, 1, 0}})));
  Revive(killed_["atlas.db-wal"].size() / 2, 1);
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
