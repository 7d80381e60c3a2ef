// What the disk does to the store: reopening, locks, other schemas, damage.
#include <array>
#include <atomic>
#include <csignal>
#include <fstream>
#include <future>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

#include "server/store/disk_room.h"
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

TEST_F(DurabilityTest, ALockFileThatIsRemovedLetsNobodyElseIn) {
  Open();
  ASSERT_TRUE(std::filesystem::remove(options_.directory / "lock"));
  EXPECT_EQ(OpenSqliteStore(options_).error().code(), StatusCode::kConflict);
}

// SQLite's log would stand beside the other file, where nobody looks.
TEST_F(DurabilityTest, ALinkToAnAtlasIsRefused) {
  Open();
  store_.reset();
  const std::filesystem::path database = options_.directory / "atlas.db";
  const std::filesystem::path elsewhere = options_.directory.string() + ".elsewhere";
  std::filesystem::rename(database, elsewhere);
  std::filesystem::create_symlink(elsewhere, database);
  EXPECT_EQ(OpenSqliteStore(options_).error().code(), StatusCode::kInvalidArgument);
  std::filesystem::remove(database);
  std::filesystem::rename(elsewhere, database);
  const std::filesystem::path folder = options_.directory.string() + ".link";
  std::filesystem::create_directory_symlink(options_.directory, folder);
  options_.directory = folder;
  Open();
  store_.reset();
  std::filesystem::remove(folder);
}

// What is written would go with it.
TEST_F(DurabilityTest, AnAtlasThatIsTakenAwayTakesNoMoreUploads) {
  Open();
  UploadLimits limits;
  limits.disk_floor_bytes = 1;
  store_->SetUploadLimits(limits);
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})));
  const std::filesystem::path database = options_.directory / "atlas.db";
  const std::filesystem::path elsewhere = options_.directory.string() + ".elsewhere";
  std::filesystem::rename(database, elsewhere);
  std::this_thread::sleep_for(DiskRoom::kFresh);
  EXPECT_EQ(Put(MakeKeyframe(2, {kA})).error().code(), StatusCode::kUnavailable);
  std::filesystem::rename(elsewhere, database);
  std::this_thread::sleep_for(DiskRoom::kFresh);
  EXPECT_TRUE(Put(MakeKeyframe(2, {kA})));
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
  Open();
  TamperBeside(
      "CREATE TRIGGER no_start BEFORE INSERT ON starts BEGIN SELECT raise(ABORT, 'no'); END");
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
