// Files that are no atlas, or not a whole one: each refused with its own code, and left as it is.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "server/store/sqlite/schema/schema.h"
#include "tests/server/store/snapshot_fixture.h"

namespace atlas {
namespace {

using ::testing::HasSubstr;
using SnapshotRefusalTest = SnapshotTest;

TEST_F(SnapshotRefusalTest, WhatIsNoFileIsRefusedAndNotMade) {
  Fill();
  const fs::path missing = directory_ / "nowhere.db";
  EXPECT_EQ(CodeOf(missing), StatusCode::kNotFound);
  EXPECT_FALSE(fs::exists(missing));
  const auto folder = OpenFile(options_.directory);
  ASSERT_FALSE(folder);
  EXPECT_EQ(folder.error().code(), StatusCode::kInvalidArgument);
  EXPECT_THAT(folder.error().message(), HasSubstr(Database().string()));
  const fs::path pipe = directory_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(CodeOf(pipe), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf("/dev/null"), StatusCode::kInvalidArgument);
  fs::create_symlink(Database(), directory_ / "link.db");
  EXPECT_EQ(CodeOf(directory_ / "link.db"), StatusCode::kOk);
}

TEST_F(SnapshotRefusalTest, AFileThatMayNotBeReadIsForbidden) {
  Fill();
  store_.reset();
  fs::permissions(directory_, fs::perms(0755));
  fs::permissions(Database(), fs::perms(0000));
  const AsNobody nobody;
  EXPECT_EQ(CodeOf(Database()), StatusCode::kPermissionDenied);
}

TEST_F(SnapshotRefusalTest, WhatIsNoAtlasIsInvalid) {
  const auto write = [this](const std::string& text) {
    std::ofstream(directory_ / "file.db", std::ios::binary) << text;
    return CodeOf(directory_ / "file.db");
  };
  EXPECT_EQ(write(""), StatusCode::kInvalidData);
  EXPECT_EQ(write("short"), StatusCode::kInvalidData);
  EXPECT_EQ(write(std::string(20'000, 'x')), StatusCode::kInvalidData);
  Fill();
  Tamper("PRAGMA application_id = 7");
  EXPECT_EQ(CodeOf(Database()), StatusCode::kInvalidData);
  Tamper("PRAGMA application_id = " + std::to_string(kStoreApplicationId));
  EXPECT_EQ(CodeOf(Database()), StatusCode::kOk);
  Tamper("DROP TABLE dirty_tiles");
  EXPECT_EQ(CodeOf(Database()), StatusCode::kInvalidData);
  Tamper("UPDATE meta SET epoch = 2");
  EXPECT_EQ(CodeOf(Database()), StatusCode::kInvalidData);
  fs::resize_file(Database(), 3 * 8'192);
  EXPECT_EQ(CodeOf(Database()), StatusCode::kInvalidData);
}

TEST_F(SnapshotRefusalTest, AnotherSchemaVersionIsUnsupported) {
  Fill();
  for (const auto& [version, advice] :
       {std::pair{kFirstReadableVersion - 1, "open it once with atlasd"},
        std::pair{kStoreSchemaVersion + 1, "use the version that wrote it"}}) {
    Tamper("PRAGMA user_version = " + std::to_string(version));
    const auto snapshot = OpenFile(Database());
    ASSERT_FALSE(snapshot);
    EXPECT_EQ(snapshot.error().code(), StatusCode::kUnsupported);
    EXPECT_THAT(snapshot.error().message(), HasSubstr(advice));
  }
}

TEST_F(SnapshotRefusalTest, ADamagedTileIsNamedAndOthersAreGood) {
  Fill();
  const TileId damaged{0, 4, -4};
  Tamper("UPDATE tiles SET blob = x'ff010203' WHERE key = " + std::to_string(damaged.Key()));
  auto snapshot = OpenFile(Database());
  ASSERT_TRUE(snapshot) << snapshot.error().message();
  const auto tile = snapshot->ReadTile(damaged);
  ASSERT_FALSE(tile);
  EXPECT_EQ(tile.error().code(), StatusCode::kInvalidData);
  EXPECT_THAT(tile.error().message(), HasSubstr("tile 0/4/-4"));
  EXPECT_THAT(tile.error().message(), HasSubstr(Database().string()));
  EXPECT_EQ(ValueOf(*snapshot, {0, 3, -4}), 9);
}

}  // namespace
}  // namespace atlas
