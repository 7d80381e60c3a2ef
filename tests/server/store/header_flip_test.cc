// Every bit of the header of the file, turned while nobody has it open: how many pages it has,
// which are free, how they are kept. Who starts on it refuses, or spoils nothing by what it writes.
#include <fstream>
#include <iterator>

#include "tests/server/store/backup_fixture.h"

namespace atlas {
namespace {

constexpr std::size_t kHeaderBytes = 100;
constexpr std::size_t kPageCount = 28;  // 4 bytes, big-endian
constexpr std::uint32_t kKept = 20;

class HeaderFlipTest : public BackupTest {
 protected:
  void SetUp() override {
    Open();
    for (std::uint32_t i = 0; i < kKept; ++i) {
      ASSERT_TRUE(Put(Keyframe(i, 30'000)));
    }
    store_.reset();
    std::ifstream in(Database(), std::ios::binary);
    intact_ = {std::istreambuf_iterator<char>(in), {}};
  }
  // Nothing else is beside it.
  void WriteTurned(std::size_t byte, int bit) const {
    std::filesystem::remove_all(options_.directory);
    std::filesystem::create_directories(options_.directory);
    std::string turned = intact_;
    turned[byte] = static_cast<char>(turned[byte] ^ (1 << bit));
    std::ofstream(Database(), std::ios::binary) << turned;
  }
  std::string Contents() const {
    std::ifstream in(Database(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // Some may be refused.
  void Live() {
    for (std::uint32_t i = kKept; i < kKept + 6; ++i) {
      static_cast<void>(Put(Keyframe(i, 30'000)));
    }
    store_.reset();
  }
  std::uint32_t CountWhole() {
    std::uint32_t whole = 0;
    for (std::int64_t id = 1; id <= kKept; ++id) {
      whole += store_->ReadKeyframe(id) && store_->ReadKeyframeBlob(id) ? 1U : 0U;
    }
    return whole;
  }

  std::string intact_;
};

TEST_F(HeaderFlipTest, NothingIsSpoiledByWhatIsWritten) {
  int refused = 0;
  int lived = 0;
  for (std::size_t byte = 0; byte < kHeaderBytes; ++byte) {
    for (int bit = 0; bit < 8; ++bit) {
      SCOPED_TRACE("bit " + std::to_string(bit) + " of byte " + std::to_string(byte));
      WriteTurned(byte, bit);
      auto store = OpenSqliteStore(options_);
      if (!store) {
        ++refused;
        continue;
      }
      ++lived;
      store_ = std::move(*store);
      Live();
      ASSERT_NO_FATAL_FAILURE(Open());
      EXPECT_EQ(CountWhole(), kKept);
      store_.reset();
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(lived, 100);
}

// New pages would be written over those that are behind its end.
TEST_F(HeaderFlipTest, AnEndBeforeThatOfTheFileIsRefused) {
  int earlier = 0;
  for (int bit = 0; bit < 32; ++bit) {
    const std::size_t byte = kPageCount + static_cast<std::size_t>(bit) / 8;
    if ((static_cast<unsigned char>(intact_[byte]) & (1U << bit % 8)) == 0) {
      continue;
    }
    ++earlier;
    WriteTurned(byte, bit % 8);
    const std::string before = Contents();
    const auto refused = OpenSqliteStore(options_);
    ASSERT_FALSE(refused) << bit;
    EXPECT_EQ(refused.error().code(), StatusCode::kInvalidData);
    EXPECT_EQ(Contents(), before) << "nothing was changed";
  }
  EXPECT_GT(earlier, 1);
}

}  // namespace
}  // namespace atlas
