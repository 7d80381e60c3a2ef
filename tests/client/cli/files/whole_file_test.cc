#include "client/cli/files/whole_file.h"

#include <filesystem>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

namespace atlas {
namespace {

class WholeFileTest : public ::testing::Test {
 protected:
  WholeFileTest()
      : folder_(std::filesystem::temp_directory_path() /
                ("atlas_whole_file_test_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~WholeFileTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

StatusCode CodeOf(const Result<std::string>& result) {
  return result ? StatusCode::kOk : result.error().code();
}

TEST_F(WholeFileTest, ReadsWhatWasWritten) {
  for (const std::size_t size : {0U, 1U, 65'535U, 65'536U, 65'537U, 200'000U}) {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7);
    ASSERT_TRUE(WriteWholeFile(folder_ / "file", bytes).ok());
    const Result<std::string> text = ReadWholeFile(folder_ / "file", size);
    ASSERT_TRUE(text) << text.error().message();
    EXPECT_EQ(Bytes(text->begin(), text->end()), bytes);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "file.partial"));
    if (size > 0) {
      EXPECT_EQ(CodeOf(ReadWholeFile(folder_ / "file", size - 1)), StatusCode::kResourceExhausted);
    }
  }
}

TEST_F(WholeFileTest, ReadsAPipeToItsEnd) {
  const std::filesystem::path pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const std::string sent(300'000, 'x');
  std::thread writer([&] { std::ofstream(pipe) << sent; });
  const Result<std::string> text = ReadWholeFile(pipe, 1'000'000);
  writer.join();
  ASSERT_TRUE(text) << text.error().message();
  EXPECT_EQ(*text, sent);
  EXPECT_EQ(ReadWholeFile("/dev/null", 10).value(), "");
}

TEST_F(WholeFileTest, SaysWhatIsWrong) {
  EXPECT_EQ(CodeOf(ReadWholeFile(folder_ / "none", 10)), StatusCode::kNotFound);
  EXPECT_EQ(CodeOf(ReadWholeFile(folder_, 10)), StatusCode::kInvalidData);
  EXPECT_EQ(CodeOf(ReadWholeFile(folder_ / "none" / "in", 10)), StatusCode::kNotFound);
  EXPECT_EQ(WriteWholeFile(folder_ / "none" / "in", {}).code(), StatusCode::kNotFound);
  ASSERT_TRUE(WriteWholeFile(folder_ / "file", {}).ok());
  EXPECT_EQ(MakeDirectory(folder_ / "file").code(), StatusCode::kConflict);
}

}  // namespace
}  // namespace atlas
