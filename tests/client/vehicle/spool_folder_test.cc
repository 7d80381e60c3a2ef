// One program a folder, and nothing that was acknowledged is lost however that program ends.
#include <csignal>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "client/vehicle/folder_lock.h"
#include "client/vehicle/numbered_files.h"
#include "client/vehicle/stored_file.h"
#include "tests/client/vehicle/spool_peer.h"

namespace atlas {
namespace {

// Puts until it is killed, and says each time that it is done. Never returns.
[[noreturn]] void PutForEver(const SpoolOptions& options, int say) {
  auto spool = UploadSpool::Open(options);
  for (std::uint32_t sequence = 0; spool && PutOne(*spool, sequence).ok(); ++sequence) {
    if (write(say, "!", 1) != 1) break;
  }
  _exit(1);
}

TEST(SpoolFolderTest, ASecondSpoolIsAConflictUntilTheFirstIsGone) {
  const TestFolder folder;
  const SpoolOptions options{.folder = folder.path() / "spool"};
  {
    auto first = UploadSpool::Open(options);
    ASSERT_TRUE(first) << first.error().message();
    const auto second = UploadSpool::Open(options);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code(), StatusCode::kConflict);
    EXPECT_NE(second.error().message().find(options.folder.string()), std::string::npos);
    UploadSpool moved = *std::move(first);
    EXPECT_FALSE(UploadSpool::Open(options)) << "the lock moved along";
    EXPECT_TRUE(PutOne(moved, 1).ok());
  }
  const auto later = UploadSpool::Open(options);
  ASSERT_TRUE(later) << later.error().message();
  EXPECT_EQ(later->waiting(), 1U);
}

TEST(SpoolFolderTest, AKilledProgramLosesNothingThatPutAcknowledgedAndLeavesTheFolderFree) {
  const TestFolder folder;
  const SpoolOptions options{.folder = folder.path()};
  std::size_t least = 0;
  for (int round = 0; round < 5; ++round) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) PutForEver(options, ends[1]);
    close(ends[1]);
    char done = 0;
    for (int put = 0; put < 3 + round; ++put) {
      ASSERT_EQ(read(ends[0], &done, 1), 1);
      ++least;
    }
    const auto meanwhile = UploadSpool::Open(options);
    EXPECT_EQ(meanwhile ? StatusCode::kOk : meanwhile.error().code(), StatusCode::kConflict);
    ASSERT_EQ(kill(child, SIGKILL), 0);
    ASSERT_EQ(waitpid(child, nullptr, 0), child);
    while (read(ends[0], &done, 1) == 1) {
      ++least;
    }
    close(ends[0]);
    const auto spool = UploadSpool::Open(options);
    ASSERT_TRUE(spool) << spool.error().message();
    EXPECT_GE(spool->waiting(), least);
    EXPECT_LE(spool->waiting(), least + 1);  // one that was on the disk and could not be said
    least = spool->waiting();
  }
}

TEST(SpoolFolderTest, AFileThatIsThereAlreadyIsNotReplaced) {
  const TestFolder folder;
  const SpoolOptions options{.folder = folder.path()};
  auto spool = UploadSpool::Open(options);
  ASSERT_TRUE(PutOne(*spool, 1).ok());
  const fs::path taken = folder.path() / NumberedName(2, ".keyframe");
  std::ofstream(taken) << "put here by hand";
  ASSERT_TRUE(PutOne(*spool, 2).ok());
  EXPECT_EQ(fs::file_size(taken), 16U);
  EXPECT_EQ(spool->waiting(), 2U);
  EXPECT_TRUE(fs::exists(folder.path() / NumberedName(3, ".keyframe")));

  const Bytes bytes{1, 2, 3};
  EXPECT_EQ(StoreNewFile(taken, bytes).code(), StatusCode::kConflict);
  EXPECT_EQ(MoveFile(folder.path() / NumberedName(3, ".keyframe"), taken).code(),
            StatusCode::kConflict);
  EXPECT_EQ(fs::file_size(taken), 16U);
  EXPECT_FALSE(fs::exists(taken.string() + ".partial"));
  EXPECT_TRUE(StoreFile(taken, bytes, Durability::kWhole).ok());
  EXPECT_EQ(fs::file_size(taken), 3U);
}

TEST(SpoolFolderTest, AFolderThatCannotBeReadIsAFailureAndNotEmpty) {
  const TestFolder folder;
  EXPECT_EQ(NumberedFiles(folder.path() / "nowhere", ".keyframe").error().code(),
            StatusCode::kNotFound);
  EXPECT_TRUE(NumberedFiles(folder.path(), ".keyframe")->empty());
  std::ofstream(folder.path() / "file") << "no folder";
  EXPECT_FALSE(NumberedFiles(folder.path() / "file", ".keyframe"));
}

}  // namespace
}  // namespace atlas
