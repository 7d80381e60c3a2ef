#include "client/merge/memory/temporary_folder.h"

#include <chrono>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

class TemporaryFolderTest : public ::testing::Test {
 protected:
  static Result<TemporaryFolder> Make(const fs::path& among) {
    return MakeTemporaryFolder({among, "atlas-merge.", std::chrono::hours(1)});
  }
  // As somebody left it that long ago.
  fs::path Left(const std::string& name, std::chrono::minutes ago) const {
    const fs::path path = folder_.path() / name;
    fs::create_directory(path);
    std::ofstream(path / "found.log") << "what was found";
    std::ofstream(path / "lock").close();
    fs::last_write_time(path / "lock", fs::file_time_type::clock::now() - ago);
    return path;
  }

  TestFolder folder_;
};

constexpr std::chrono::minutes kLongAgo{90};

TEST_F(TemporaryFolderTest, WhatAKilledMergeLeftGoesWithTheNext) {
  const fs::path left = Left("atlas-merge.AAAAAA", kLongAgo);
  const auto made = Make(folder_.path());
  ASSERT_TRUE(made.has_value()) << made.error().message();
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(fs::is_directory(made->path));
}

TEST_F(TemporaryFolderTest, WhatIsInUseOrNewOrAnothersStays) {
  const fs::path used = Left("atlas-merge.AAAAAA", kLongAgo);
  const auto lock = FolderLock::Take(used);
  ASSERT_TRUE(lock.has_value());
  const fs::path fresh = Left("atlas-merge.BBBBBB", std::chrono::minutes(30));
  const fs::path other = Left("other", kLongAgo);
  fs::create_directory_symlink(other, folder_.path() / "atlas-merge.CCCCCC");
  const fs::path never_locked = Left("atlas-merge.DDDDDD", kLongAgo);
  fs::remove(never_locked / "lock");
  ASSERT_TRUE(Make(folder_.path()).has_value());
  for (const fs::path& path : {used, fresh, other, never_locked}) {
    EXPECT_TRUE(fs::exists(path / "found.log")) << path;
  }
}

TEST_F(TemporaryFolderTest, APlaceMayCallEverythingLeftThatIsNotLocked) {
  const fs::path left = Left("atlas-merge.AAAAAA", std::chrono::minutes(1));
  ASSERT_TRUE(MakeTemporaryFolder({folder_.path(), "atlas-merge."}).has_value());
  EXPECT_FALSE(fs::exists(left));
}

TEST_F(TemporaryFolderTest, ItIsLockedWhileSomebodyHasIt) {
  auto made = Make(folder_.path());
  ASSERT_TRUE(made.has_value());
  EXPECT_FALSE(FolderLock::Take(made->path).has_value());
  const fs::path path = made->path;
  made = Error(StatusCode::kNotFound, "gone");
  EXPECT_TRUE(FolderLock::Take(path).has_value());
}

TEST_F(TemporaryFolderTest, NowhereIsAnError) {
  EXPECT_FALSE(Make(folder_.path() / "none").has_value());
}

}  // namespace
}  // namespace atlas
