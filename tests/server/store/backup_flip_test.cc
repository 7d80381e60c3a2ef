// Whatever bit of a backup turns: it is refused before anything is written, or what it was turned
// in is of no atlas.
#include <fstream>
#include <random>

#include "tests/core/support/test_scale.h"
#include "tests/server/store/backup_fixture.h"

namespace atlas {
namespace {

class BackupFlipTest : public BackupTest {
 protected:
  void Flip(std::uint64_t bit) {
    std::fstream file(backup(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(bit / 8));
    const auto byte = static_cast<char>(file.get() ^ (1 << (bit % 8)));
    file.seekp(static_cast<std::streamoff>(bit / 8));
    file.put(byte);
    ASSERT_TRUE(file.flush().good());
  }
};

TEST_F(BackupFlipTest, IsFoundOrHarmless) {
  Fill(40, 20'000);
  ASSERT_TRUE(WriteBackup().has_value());
  store_.reset();
  const auto rows = RowsOf(backup());
  std::mt19937_64 random(7);
  const std::uint64_t bits = std::filesystem::file_size(backup()) * 8;
  int found = 0;
  int harmless = 0;
  for (std::uint32_t i = 0; i < testing::Scaled(300) && !HasFailure(); ++i) {
    const std::uint64_t bit = random() % bits;
    SCOPED_TRACE("bit " + std::to_string(bit));
    Flip(bit);
    const auto done = Restore();
    if (done) {
      ++harmless;
      EXPECT_EQ(RowsOf(restored()), rows);
    } else {
      ++found;
      const StatusCode code = done.error().code();
      EXPECT_TRUE(code == StatusCode::kInvalidData || code == StatusCode::kUnsupported)
          << done.error().message();
      EXPECT_FALSE(std::filesystem::exists(restored().parent_path())) << "nothing is written";
    }
    std::filesystem::remove_all(restored().parent_path());
    Flip(bit);
  }
  EXPECT_GT(found, harmless);
  RecordProperty("found", found);
  RecordProperty("harmless", harmless);
}

}  // namespace
}  // namespace atlas
