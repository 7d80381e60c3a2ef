// A disk without room, or that is read-only, under the store.
#include <chrono>
#include <fstream>
#include <future>
#include <thread>

#include <sys/mount.h>
#include <unistd.h>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const TileId kA{0, 0, 0};

// A file system of its own size, for root only.
class DiskTest : public StoreTest {
 protected:
  void SetUp() override {
    mount_ = directory_ / "disk";
    std::filesystem::create_directories(mount_);
    if (::geteuid() != 0 || ::mount("none", mount_.c_str(), "tmpfs", 0, "size=1m") != 0) {
      GTEST_SKIP() << "needs root and a tmpfs mount";
    }
    is_mounted_ = true;
    options_.directory = mount_ / "data";
  }
  void TearDown() override {
    store_.reset();
    if (is_mounted_) {
      ::umount2(mount_.c_str(), MNT_DETACH);
    }
  }
  NewKeyframe Big(std::uint32_t sequence) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {kA});
    keyframe.blob.resize(50'000, 1);
    return keyframe;
  }

  std::filesystem::path mount_;
  bool is_mounted_ = false;
};

TEST_F(DiskTest, AFullDiskRefusesWritesKeepsReadsAndRecovers) {
  Open();
  std::uint64_t accepted = 0;
  Status refusal;
  for (std::uint32_t i = 0; i < 100 && refusal.ok(); ++i) {
    const auto put = Put(Big(i));
    accepted += put ? 1u : 0u;
    refusal = put ? Status() : put.error();
  }
  EXPECT_EQ(refusal.code(), StatusCode::kResourceExhausted) << refusal.message();
  EXPECT_GT(accepted, 0u);
  EXPECT_EQ(store_->ReadCounts()->keyframes, accepted);
  EXPECT_EQ(store_->GatherTile(kA, 0)->keyframes.size(), accepted);
  ASSERT_EQ(::mount("none", mount_.c_str(), "tmpfs", MS_REMOUNT, "size=16m"), 0);
  const auto after = Put(Big(1000));
  ASSERT_TRUE(after.has_value()) << after.error().message();
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, accepted + 1);
}

TEST_F(DiskTest, AnAtlasThatWasClosedOpensOnAFullDisk) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  ASSERT_TRUE(Finish(Claim().claims.at(0), Content(7)).has_value());
  store_.reset();
  const std::filesystem::path filler = mount_ / "filler";
  {
    std::ofstream out(filler, std::ios::binary);
    while (out.write("x", 1).flush()) {
    }
  }
  ASSERT_EQ(std::filesystem::space(mount_).available, 0U);
  Open();
  ASSERT_NE(store_, nullptr);
  EXPECT_TRUE(store_->ReadTile(kA)->has_value());
  EXPECT_EQ(Put(Big(2)).error().code(), StatusCode::kResourceExhausted);
  Open();
  ASSERT_NE(store_, nullptr) << "and once more";
  std::filesystem::remove(options_.directory / "atlas.db.room");
  store_.reset();
  std::filesystem::remove(options_.directory / "atlas.db.room");
  {
    std::ofstream out(filler, std::ios::binary | std::ios::app);
    while (out.write("x", 1).flush()) {
    }
  }
  EXPECT_EQ(OpenCode(), StatusCode::kResourceExhausted) << "without it there is no index of a log";
  std::filesystem::remove(filler);
  Open();
  EXPECT_TRUE(Put(Big(2)).has_value());
}

TEST_F(DiskTest, WhatAFullDiskRefusedComesBeforeWhatIsBehindIt) {
  Open();
  const auto missing = std::make_shared<MissingUploads>();
  const auto send = [&](std::uint32_t sequence) {
    NewKeyframe keyframe = Big(sequence);
    keyframe.missing = missing;
    return Put(std::move(keyframe));
  };
  std::uint32_t refused = 0;
  while (refused < 100 && send(refused)) {
    ++refused;
  }
  ASSERT_LT(refused, 100u);
  ASSERT_EQ(::mount("none", mount_.c_str(), "tmpfs", MS_REMOUNT, "size=16m"), 0);
  EXPECT_EQ(send(refused + 1).error().code(), StatusCode::kUnavailable);
  for (const std::uint32_t sequence : {refused, refused + 1, refused + 2}) {
    const auto put = send(sequence);
    EXPECT_TRUE(put.has_value()) << put.error().message();
  }
}

// Whole groups fail then, of which the first ones were told that they are there.
TEST_F(DiskTest, WhatAFullDiskRefusedOfAWindowLeavesNoGap) {
  constexpr std::uint32_t kCount = 100;
  Open();
  const auto missing = std::make_shared<MissingUploads>();
  ASSERT_TRUE(Put(Big(0)).has_value());
  std::uint32_t stored = 1;  // of a window that is one group not even the first need find room
  const auto send_the_rest = [&] {
    std::vector<std::future<Result<PutKeyframeResult>>> answers;
    for (std::uint32_t i = stored; i < kCount; ++i) {
      NewKeyframe keyframe = Big(i);
      keyframe.missing = missing;
      answers.push_back(Begin<PutKeyframeResult>(
          [&](auto done) { store_->PutKeyframe(std::move(keyframe), std::move(done)); }));
    }
    bool is_refused = false;
    for (auto& answer : answers) {
      const bool is_stored = answer.get().has_value();
      EXPECT_FALSE(is_stored && is_refused) << "behind one that was refused";
      is_refused = is_refused || !is_stored;
      stored += is_stored ? 1 : 0;
    }
  };
  send_the_rest();
  EXPECT_LT(stored, kCount);
  send_the_rest();
  EXPECT_LT(stored, kCount);
  ASSERT_EQ(::mount("none", mount_.c_str(), "tmpfs", MS_REMOUNT, "size=64m"), 0);
  send_the_rest();
  EXPECT_EQ(stored, kCount);
}

// The log has them: they were acknowledged, and stay.
TEST_F(DiskTest, WhatFindsNoRoomInTheDatabaseIsTold) {
  ASSERT_EQ(::mount("none", mount_.c_str(), "tmpfs", MS_REMOUNT, "size=10m"), 0);
  Open();
  constexpr std::uintmax_t kLogThatIsCopied = 1'000 * (8'192 + 24);
  std::uint32_t accepted = 0;
  while (std::filesystem::file_size(Database().string() + "-wal") < kLogThatIsCopied) {
    ASSERT_TRUE(Put(Big(accepted)).has_value());
    ++accepted;
  }
  std::optional<WriteRefusal> refusal;
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!refusal && std::chrono::steady_clock::now() < patience) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    refusal = store_->ReadWriteFigures().last_refusal;
  }
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->why.code(), StatusCode::kResourceExhausted) << refusal->why.message();
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, accepted);
}

TEST_F(DiskTest, AnAtlasOnAFullDiskIsOpened) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1'000, {{0, 1, 1}})));
  ASSERT_EQ(Claim().claims.size(), 1u);  // a lease that the next start has to drop
  std::uint64_t accepted = 1;
  for (std::uint32_t i = 0; Put(Big(i)).has_value(); ++i) {
    ++accepted;
  }
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, accepted);
}

TEST_F(DiskTest, NoAtlasIsHalfMadeOnAFullDisk) {
  ASSERT_EQ(::mount("none", mount_.c_str(), "tmpfs", MS_REMOUNT, "size=32k"), 0);
  EXPECT_EQ(OpenCode(), StatusCode::kResourceExhausted);
  EXPECT_FALSE(std::filesystem::exists(Database()));
  ASSERT_EQ(::mount("none", mount_.c_str(), "tmpfs", MS_REMOUNT, "size=16m"), 0);
  EXPECT_EQ(OpenCode(), StatusCode::kOk);
}

TEST_F(DiskTest, AReadOnlyDiskIsRefused) {
  Open();
  store_.reset();
  ASSERT_EQ(::mount("none", mount_.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, "size=1m"), 0);
  EXPECT_EQ(OpenCode(), StatusCode::kPermissionDenied);
}

}  // namespace
}  // namespace atlas
