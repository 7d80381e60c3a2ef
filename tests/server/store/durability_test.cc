// What the disk does to the store: reopening, locks, other schemas, damage, no room, no right.
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <future>
#include <thread>

#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const TileId kA{0, 0, 0};

class DurabilityTest : public StoreTest {
 protected:
  void OpenWithOneTile() {
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
    ASSERT_TRUE(Finish(Claim().claims.at(0), Content(7)).has_value());
  }
};

TEST_F(DurabilityTest, AnAcknowledgedGroupIsThereAfterReopening) {
  Open();
  constexpr int kUploads = 300;
  std::atomic<int> acknowledged = 0;
  std::promise<void> all;
  for (std::uint32_t i = 0; i < kUploads; ++i) {
    store_->PutKeyframe(MakeKeyframe(i, {kA}), [&](const Result<PutKeyframeResult>& result) {
      EXPECT_TRUE(result.has_value());
      if (++acknowledged == kUploads) {
        all.set_value();
      }
    });
  }
  all.get_future().wait();
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 300u);
  EXPECT_EQ(store_->ReadCounts()->revision, 300u);
  EXPECT_EQ(store_->GatherTile(kA, 0)->keyframes.size(), 300u);
}

TEST_F(DurabilityTest, AnAcknowledgedWriteSurvivesAKilledProcess) {
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(::pipe(pipe_ends.data()), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    Open();
    const char ok = Put(MakeKeyframe(1, {kA})).has_value() ? 1 : 0;
    [[maybe_unused]] const auto written = ::write(pipe_ends[1], &ok, 1);
    ::pause();
  }
  ::close(pipe_ends[1]);  // so that the read below ends when the child does
  char ok = 0;
  ASSERT_EQ(::read(pipe_ends[0], &ok, 1), 1);
  EXPECT_EQ(OpenCode(), StatusCode::kConflict);  // the child holds the directory
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ::close(pipe_ends[0]);
  ASSERT_EQ(ok, 1);
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 1u);
  EXPECT_EQ(Dirty().dirty_tiles, 1u);
}

TEST_F(DurabilityTest, ASecondOpenIsRefusedAndNamesTheProcess) {
  Open();
  const auto second = OpenSqliteStore(options_);
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().code(), StatusCode::kConflict);
  EXPECT_NE(second.error().message().find(std::to_string(::getpid())), std::string::npos);
}

TEST_F(DurabilityTest, IdentityIsKept) {
  options_.new_profile->cell_size_um = 200'000;
  Open();
  options_.new_profile = MapProfile();
  options_.new_atlas_id = {9};
  Open();
  EXPECT_EQ(store_->identity().profile.cell_size_um, 200'000u);
  EXPECT_EQ(store_->identity().atlas_id[0], 1);
}

TEST_F(DurabilityTest, AStartIsNotedWithItsFirstChangeAndTheRevisionItGoesOnFrom) {
  Open();
  EXPECT_TRUE(store_->ReadLine()->starts.empty());
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  ASSERT_TRUE(Put(MakeKeyframe(2, {kA})).has_value());
  ASSERT_EQ(store_->ReadLine()->starts.size(), 1u);
  const AtlasStart first = store_->ReadLine()->starts[0];
  EXPECT_EQ(first.revision, 0u);
  const std::uint64_t revision = store_->ReadCounts()->revision;
  Open();
  EXPECT_EQ(store_->ReadLine()->starts.size(), 1u) << "nothing changed yet";
  EXPECT_EQ(store_->ReadLine()->revision, revision);
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(3, {kA})).has_value());
  const auto line = store_->ReadLine();
  ASSERT_EQ(line->starts.size(), 2u);
  EXPECT_EQ(line->starts[0], first);
  EXPECT_NE(line->starts[1].id, first.id);
  EXPECT_EQ(line->starts[1].revision, revision);
  EXPECT_GT(line->revision, revision);
}

TEST_F(DurabilityTest, AHundredStartsAreKept) {
  for (std::uint32_t i = 0; i < 103; ++i) {
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(i, {kA})).has_value());
  }
  EXPECT_EQ(store_->ReadLine()->starts.size(), 100u);
}

TEST_F(DurabilityTest, WhatCameBeforeADamagedStartIsForgotten) {
  for (std::uint32_t i = 0; i < 4; ++i) {
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(i, {kA})).has_value());
  }
  const AtlasStart third = store_->ReadLine()->starts[2];
  Tamper("UPDATE starts SET revision = 7 WHERE number = 2");
  Open();
  ASSERT_EQ(store_->ReadLine()->starts.size(), 2u);
  EXPECT_EQ(store_->ReadLine()->starts[0], third);
}

TEST_F(DurabilityTest, NothingChangesWhereTheStartCannotBeNoted) {
  OpenWithOneTile();
  Tamper("CREATE TRIGGER no_start BEFORE INSERT ON starts BEGIN SELECT raise(ABORT, 'no'); END");
  Open();
  const auto line = store_->ReadLine();
  EXPECT_FALSE(Put(MakeKeyframe(2, {kA})).has_value());
  EXPECT_EQ(store_->ReadLine()->revision, line->revision);
  EXPECT_EQ(store_->ReadLine()->starts, line->starts);
  EXPECT_EQ(store_->ReadCounts()->keyframes, 1u);
  Tamper("DROP TRIGGER no_start");
  Open();
  EXPECT_TRUE(Put(MakeKeyframe(2, {kA})).has_value());
}

TEST_F(DurabilityTest, WithoutAProfileNothingIsCreated) {
  options_.new_profile.reset();
  EXPECT_EQ(OpenCode(), StatusCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(Database()));
}

TEST_F(DurabilityTest, ADirectoryOfOtherFilesIsLeftAlone) {
  std::filesystem::create_directories(options_.directory);
  std::ofstream(options_.directory / "holiday.jpg") << "x";
  EXPECT_EQ(OpenCode(), StatusCode::kInvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(options_.directory / "lock"));
}

TEST_F(DurabilityTest, ANewerSchemaIsRefused) {
  Open();
  Tamper("PRAGMA user_version = 99");
  EXPECT_EQ(OpenCode(), StatusCode::kUnsupported);
}

TEST_F(DurabilityTest, AnotherProgramsDatabaseIsRefused) {
  Open();
  Tamper("PRAGMA application_id = 7");
  EXPECT_EQ(OpenCode(), StatusCode::kInvalidData);
  std::ofstream(Database(), std::ios::trunc) << std::string(20'000, 'x');
  EXPECT_EQ(OpenCode(), StatusCode::kInvalidData);
}

TEST_F(DurabilityTest, ADamagedProfileIsRefused) {
  Open();
  Tamper("UPDATE meta SET epoch = 5");
  EXPECT_EQ(OpenCode(), StatusCode::kInvalidData);
}

TEST_F(DurabilityTest, DamagedRowsAreDetectedAndTheOthersServed) {
  const std::vector<std::string> damages = {
      "UPDATE keyframes SET time_ms = time_ms + 1",
      "UPDATE keyframes SET radius_cells = 7",
      "UPDATE poses SET x_um = 1",
      "DELETE FROM poses",
      "UPDATE sessions SET vehicle = 'car'",
  };
  for (const std::string& damage : damages) {
    SCOPED_TRACE(damage);
    std::filesystem::remove_all(options_.directory);
    OpenWithOneTile();
    Tamper(damage);
    Open();
    const auto sources = store_->GatherTile(kA, 0);
    ASSERT_FALSE(sources.has_value());
    EXPECT_EQ(sources.error().code(), StatusCode::kInvalidData);
    EXPECT_TRUE(store_->ReadTile(kA)->has_value());
    EXPECT_TRUE(Put([] {
                  NewKeyframe keyframe = MakeKeyframe(9, {});
                  keyframe.key.session.session = "other";
                  return keyframe;
                }())
                    .has_value());
    store_.reset();
  }
}

TEST_F(DurabilityTest, DamagedBlobsAreDetected) {
  OpenWithOneTile();
  Tamper("UPDATE keyframes SET blob = x'070702'; UPDATE tiles SET blob = x'07010204'");
  Open();
  EXPECT_EQ(store_->ReadKeyframeBlob(1).error().code(), StatusCode::kInvalidData);
  const auto tile = store_->ReadTile(kA);
  ASSERT_FALSE(tile.has_value());
  EXPECT_EQ(tile.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(tile.error().message().find("0/0/0"), std::string::npos);
}

TEST_F(DurabilityTest, ADamagedTileIsHealedByBuildingItAgain) {
  OpenWithOneTile();
  Tamper("UPDATE tiles SET cells = 1000000");
  Open();
  ASSERT_TRUE(Await<std::uint32_t>([&](auto done) {
                store_->MarkDirty({kA}, std::move(done));
              }).has_value());
  ASSERT_TRUE(Finish(Claim().claims.at(0), Content(7)).has_value());
  EXPECT_TRUE(store_->ReadTile(kA)->has_value());
  EXPECT_EQ(store_->ReadCounts()->cells, 10u);
  EXPECT_EQ(store_->ReadCounts()->tiles, 1u);
}

// A file system of its own size, for root only.
class DiskTest : public DurabilityTest {
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

TEST_F(DurabilityTest, ATableThatIsGoneIsDamage) {
  for (const char* const table : {"sessions", "keyframes", "poses", "tiles", "dirty_tiles",
                                  "counters", "table_sums", "starts", "events", "meta"}) {
    SCOPED_TRACE(table);
    std::filesystem::remove_all(options_.directory);
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(1, {{0, 1, 2}})));
    Tamper(std::string("DROP TABLE ") + table);
    EXPECT_EQ(OpenCode(), StatusCode::kInvalidData);
  }
}

}  // namespace
}  // namespace atlas
