// Records come back as they were set aside, and nothing stays behind.
#include "server/service/history/scratch_file.h"

#include <gtest/gtest.h>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

using ScratchFileTest = ServiceTest;

TEST_F(ScratchFileTest, RecordsComeBackInOrderAndTheFileHasNoName) {
  auto file = ScratchFile::Create(directory_);
  ASSERT_TRUE(file.has_value()) << file.error().message();
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
  std::vector<Bytes> records = {{1, 2, 3}, {}, Bytes(100'000, 7)};
  for (std::size_t i = 0; i < records.size(); ++i) {
    ASSERT_TRUE(file->Append(i, records[i]).ok());
  }
  std::size_t next = 0;
  ASSERT_TRUE(file->Replay([&](std::uint64_t key, ByteSpan bytes) {
                    EXPECT_EQ(key, next);
                    EXPECT_EQ(Bytes(bytes.begin(), bytes.end()), records.at(next));
                    ++next;
                    return Status();
                  })
                  .ok());
  EXPECT_EQ(next, 3u);
}

TEST_F(ScratchFileTest, FailuresAreTyped) {
  EXPECT_EQ(ScratchFile::Create(directory_ / "nowhere").error().code(), StatusCode::kUnavailable);
  auto file = ScratchFile::Create(directory_);
  ASSERT_TRUE(file->Append(1, Bytes{1}).ok());
  Status stop(StatusCode::kTimeout, "enough");
  EXPECT_EQ(file->Replay([&](std::uint64_t, ByteSpan) { return stop; }), stop);
}

}  // namespace
}  // namespace atlas
