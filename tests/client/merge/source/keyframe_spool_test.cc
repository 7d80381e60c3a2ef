#include "client/merge/source/keyframe_spool.h"

#include <csignal>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/core/support/no_descriptors.h"

namespace atlas {
namespace {

// As long as it is there, files of this process end at `bytes`, as on a full disk.
class ShortFiles {
 public:
  explicit ShortFiles(rlim_t bytes) : handler_before_(std::signal(SIGXFSZ, SIG_IGN)) {
    EXPECT_EQ(::getrlimit(RLIMIT_FSIZE, &original_), 0);
    rlimit less = original_;
    less.rlim_cur = bytes;
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &less), 0);
  }
  ~ShortFiles() {
    EXPECT_EQ(::setrlimit(RLIMIT_FSIZE, &original_), 0);
    std::signal(SIGXFSZ, handler_before_);
  }
  ShortFiles(const ShortFiles&) = delete;
  ShortFiles& operator=(const ShortFiles&) = delete;
  ShortFiles(ShortFiles&&) = delete;
  ShortFiles& operator=(ShortFiles&&) = delete;

 private:
  void (*handler_before_)(int);
  rlimit original_{};
};

Bytes Filled(std::size_t size, std::uint8_t value) {
  return Bytes(size, value);
}

TEST(KeyframeSpoolTest, BlobsComeBackInAnyOrderBetweenOthersThatAreAdded) {
  auto spool = KeyframeSpool::Create();
  ASSERT_TRUE(spool.has_value());
  for (std::uint8_t i = 0; i < 20; ++i) {
    const auto number = spool->Add(Filled(std::size_t{i} * 1'000, i));
    ASSERT_TRUE(number.has_value());
    EXPECT_EQ(*number, i);
    EXPECT_EQ(*spool->Read(i / 2), Filled(std::size_t{i} / 2 * 1'000, i / 2));
  }
  for (std::uint8_t i = 20; i-- > 0;) {
    EXPECT_EQ(*spool->Read(i), Filled(std::size_t{i} * 1'000, i));
    EXPECT_EQ(*spool->Read(i), Filled(std::size_t{i} * 1'000, i)) << "again";
  }
}

TEST(KeyframeSpoolTest, AFullDiskIsSaidAndWhatWasThereStays) {
  auto spool = KeyframeSpool::Create();
  ASSERT_TRUE(spool.has_value());
  ASSERT_TRUE(spool->Add(Filled(100'000, 1)).has_value());
  ASSERT_TRUE(spool->Read(0).has_value());  // it is on the disk
  {
    const ShortFiles full(150'000);
    const auto number = spool->Add(Filled(100'000, 2));
    ASSERT_FALSE(number.has_value());
    EXPECT_EQ(number.error().code(), StatusCode::kResourceExhausted) << number.error().message();
    EXPECT_NE(number.error().message().find("cannot write a temporary file"), std::string::npos);
  }
  EXPECT_EQ(*spool->Read(0), Filled(100'000, 1));
  const auto number = spool->Add(Filled(100'000, 3));  // there is room again
  ASSERT_TRUE(number.has_value());
  EXPECT_EQ(*spool->Read(*number), Filled(100'000, 3));
}

// What is small waits in memory: it is missed when it is read, not before.
TEST(KeyframeSpoolTest, AFullDiskIsNoticedAtTheLatestWhenSomethingIsRead) {
  auto spool = KeyframeSpool::Create();
  ASSERT_TRUE(spool.has_value());
  const ShortFiles full(0);
  if (const auto number = spool->Add(Filled(10, 1)); number) {
    const auto blob = spool->Read(*number);
    ASSERT_FALSE(blob.has_value());
    EXPECT_EQ(blob.error().code(), StatusCode::kResourceExhausted) << blob.error().message();
  }
}

TEST(KeyframeSpoolTest, NoFileAtAllIsAnError) {
  const NoDescriptors none;
  const auto spool = KeyframeSpool::Create();
  ASSERT_FALSE(spool.has_value());
  EXPECT_EQ(spool.error().code(), StatusCode::kResourceExhausted) << spool.error().message();
}

}  // namespace
}  // namespace atlas
