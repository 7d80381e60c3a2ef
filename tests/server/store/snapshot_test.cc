// An atlas file read beside whoever writes it, and after them.
#include <gmock/gmock.h>

#include "tests/server/store/snapshot_fixture.h"

namespace atlas {
namespace {

using ::testing::HasSubstr;

TEST_F(SnapshotTest, AClosedAtlasIsReadAndNothingIsTouched) {
  Fill();
  const std::uint64_t revision = store_->revision();
  store_.reset();
  const FolderState before = FolderState::Of(options_.directory);
  {
    auto snapshot = OpenFile(Database());
    ASSERT_TRUE(snapshot) << snapshot.error().message();
    EXPECT_EQ(snapshot->identity().atlas_id, options_.new_atlas_id);
    EXPECT_EQ(snapshot->identity().profile, MapProfile());
    EXPECT_EQ(snapshot->state().revision, revision);
    EXPECT_EQ(snapshot->state().dirty_tiles, 0U);
    EXPECT_EQ(Level0(*snapshot), (std::vector<TileId>{{0, 3, -4}, {0, 4, -4}}));
    EXPECT_EQ(ValueOf(*snapshot, {0, 4, -4}), 9);
    EXPECT_EQ(*snapshot->ReadTile({0, 5, -4}), std::nullopt);
    EXPECT_FALSE(fs::exists(Database().string() + "-shm"));
  }
  EXPECT_EQ(FolderState::Of(options_.directory), before);
  EXPECT_FALSE(fs::exists(Database().string() + "-shm"));
}

TEST_F(SnapshotTest, BesideAWriterItStaysWhatItWas) {
  Fill();
  auto snapshot = OpenFile(Database());
  ASSERT_TRUE(snapshot) << snapshot.error().message();
  ASSERT_TRUE(Put(MakeKeyframe(2, {{0, 4, -4}, {0, 9, 9}})));
  auto unfused = OpenFile(Database());
  ASSERT_TRUE(unfused) << unfused.error().message();
  EXPECT_EQ(unfused->state().dirty_tiles, 2U);
  EXPECT_EQ(ValueOf(*unfused, {0, 4, -4}), 9);
  Fuse(5);
  EXPECT_EQ(ValueOf(*snapshot, {0, 4, -4}), 9);
  EXPECT_EQ(Level0(*snapshot).size(), 2U);
  EXPECT_EQ(snapshot->state().dirty_tiles, 0U);
  auto later = OpenFile(Database());
  ASSERT_TRUE(later);
  EXPECT_EQ(ValueOf(*later, {0, 4, -4}), 5);
  EXPECT_EQ(Level0(*later).size(), 3U);
  EXPECT_GT(later->state().revision, snapshot->state().revision);
}

TEST_F(SnapshotTest, TheLogOfAKilledWriterCounts) {
  Fill();
  const fs::path copy = CopyTo("killed");
  ASSERT_GT(fs::file_size(copy.string() + "-wal"), 0U);
  const FolderState before = FolderState::Of(copy.parent_path());
  for (int time = 0; time < 2; ++time) {
    auto snapshot = OpenFile(copy);
    ASSERT_TRUE(snapshot) << snapshot.error().message();
    EXPECT_EQ(ValueOf(*snapshot, {0, 4, -4}), 9);
  }
  EXPECT_EQ(FolderState::Of(copy.parent_path()), before);
}

TEST_F(SnapshotTest, TheEmptyLogOfACopyIsNothing) {
  Fill();
  store_.reset();
  const fs::path copy = CopyTo("copy");
  std::ofstream(copy.string() + "-wal").flush();
  const FolderState before = FolderState::Of(copy.parent_path());
  auto snapshot = OpenFile(copy);
  ASSERT_TRUE(snapshot) << snapshot.error().message();
  EXPECT_EQ(ValueOf(*snapshot, {0, 4, -4}), 9);
  EXPECT_EQ(FolderState::Of(copy.parent_path()), before);
  EXPECT_FALSE(fs::exists(copy.string() + "-shm"));
}

TEST_F(SnapshotTest, AWriterThatComesLaterIsNoticed) {
  Fill();
  store_.reset();
  auto snapshot = OpenFile(Database());
  ASSERT_TRUE(snapshot) << snapshot.error().message();
  Open();
  const auto tile = snapshot->ReadTile({0, 4, -4});
  ASSERT_FALSE(tile);
  EXPECT_EQ(tile.error().code(), StatusCode::kUnavailable);
  EXPECT_THAT(tile.error().message(), HasSubstr("began to write"));
  ASSERT_TRUE(Put(MakeKeyframe(2, {{0, 9, 9}})));
  Fuse(5);
  store_.reset();  // and gone again: the file is another one
  const Status scan = snapshot->ScanTiles({0}, [](const TileSummary&) { return Status(); });
  EXPECT_EQ(scan.code(), StatusCode::kUnavailable);
}

TEST_F(SnapshotTest, AFolderThatNobodyMayWriteToIsEnough) {
  Fill();
  store_.reset();
  const fs::path copy = CopyTo("backup");
  Protect(copy.parent_path());
  {
    const AsNobody nobody;
    auto snapshot = OpenFile(copy);
    ASSERT_TRUE(snapshot) << snapshot.error().message();
    EXPECT_EQ(ValueOf(*snapshot, {0, 3, -4}), 9);
  }
  fs::permissions(copy.parent_path(), fs::perms(0755));
}

TEST_F(SnapshotTest, ALogThatCannotBeReadWhereItLiesSaysWhatToDo) {
  Fill();
  const fs::path copy = CopyTo("killed");
  Protect(copy.parent_path());
  {
    const AsNobody nobody;
    const auto snapshot = OpenFile(copy);
    ASSERT_FALSE(snapshot);
    EXPECT_EQ(snapshot.error().code(), StatusCode::kPermissionDenied);
    EXPECT_THAT(snapshot.error().message(), HasSubstr("make the folder writable"));
  }
  fs::permissions(copy.parent_path(), fs::perms(0755));
  EXPECT_EQ(CodeOf(copy), StatusCode::kOk);
}

TEST_F(SnapshotTest, AFailingVisitEndsAScan) {
  Fill();
  auto snapshot = OpenFile(Database());
  ASSERT_TRUE(snapshot);
  int visits = 0;
  const Status status = snapshot->ScanTiles({0}, [&](const TileSummary& tile) -> Status {
    ++visits;
    EXPECT_EQ(ValueOf(*snapshot, tile.id), 9);  // reading in between is allowed
    return {StatusCode::kTimeout, "enough"};
  });
  EXPECT_EQ(status.code(), StatusCode::kTimeout);
  EXPECT_EQ(visits, 1);
}

TEST_F(SnapshotTest, OddNamesAreNames) {
  Fill();
  store_.reset();
  const fs::path odd = directory_ / "50% off? #1 ä.db";
  fs::copy(Database(), odd);
  auto snapshot = OpenFile(odd);
  ASSERT_TRUE(snapshot) << snapshot.error().message();
  EXPECT_EQ(ValueOf(*snapshot, {0, 3, -4}), 9);
}

TEST_F(SnapshotTest, MovesLikeAValue) {
  Fill();
  auto first = OpenFile(Database());
  auto second = OpenFile(Database());
  ASSERT_TRUE(first && second);
  *first = std::move(*second);
  EXPECT_EQ(ValueOf(*first, {0, 3, -4}), 9);
}

}  // namespace
}  // namespace atlas
