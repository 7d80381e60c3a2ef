#include "server/net/access/token_list.h"

#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// SHA-256 of "open sesame".
constexpr const char* kHash = "41ef4bb0b23661e66301aac36066912dac037827b4ae63a7b1165a5aa93ed4eb";
constexpr std::int64_t kNow_ms = 1'800'000'000'000;  // 2027-01-15

std::string Line(const std::string& expires) {
  return "alice admin " + expires + " " + kHash + "\n";
}

TEST(TokenListTest, FindsWhoseATokenIs) {
  const auto list = TokenList::Parse("# people\n\n" + Line("2027-01-15"), "tokens");
  ASSERT_TRUE(list.has_value()) << list.error().message();
  const auto owner = list->Find(HashOfToken("open sesame"), kNow_ms);
  ASSERT_TRUE(owner.has_value()) << owner.error().message();
  EXPECT_EQ(owner->name, "alice");
  EXPECT_EQ(owner->role, Role::kAdmin);
}

TEST(TokenListTest, ATokenOfNobodyOpensNothing) {
  const auto list = TokenList::Parse(Line("never"), "tokens");
  const auto owner = list->Find(HashOfToken("open sesam"), kNow_ms);
  ASSERT_FALSE(owner.has_value());
  EXPECT_EQ(owner.error().code(), StatusCode::kPermissionDenied);
}

TEST(TokenListTest, ADayIsItsLast) {
  const auto list = TokenList::Parse(Line("2027-01-14"), "tokens");
  const auto owner = list->Find(HashOfToken("open sesame"), kNow_ms);
  ASSERT_FALSE(owner.has_value());
  EXPECT_THAT(owner.error().message(), testing::HasSubstr("expired"));
}

TEST(TokenListTest, NamesTheLineThatIsWrong) {
  const std::string good = Line("never");
  for (const std::string& bad :
       {std::string("alice\n"), "alice boss never " + std::string(kHash),
        "alice none never " + std::string(kHash), "a/b admin never " + std::string(kHash),
        "alice admin tomorrow " + std::string(kHash),
        "alice admin 2027-02-30 " + std::string(kHash), std::string("alice admin never 1234"),
        Line("never").substr(0, 40) + "\n", "alice admin never " + std::string(64, 'g'),
        Line("never") + "x y z\n"}) {
    const auto list = TokenList::Parse(good + bad, "tokens");
    ASSERT_FALSE(list.has_value()) << bad;
    EXPECT_EQ(list.error().code(), StatusCode::kInvalidData);
    EXPECT_THAT(list.error().message(), testing::HasSubstr("tokens: line ")) << bad;
  }
}

TEST(TokenListTest, AFileThatIsNotThere) {
  const auto list = TokenList::Read("/nowhere/tokens");
  ASSERT_FALSE(list.has_value());
  EXPECT_EQ(list.error().code(), StatusCode::kNotFound);
}

TEST(TokenListTest, AFolderThatCannotBeLookedIntoIsToldSo) {
  const auto folder = std::filesystem::temp_directory_path() / StrCat("atlas_tokens_", ::getpid());
  std::filesystem::create_directory_symlink(folder.filename(), folder);  // leads to itself
  const auto list = TokenList::Read(folder / "tokens");
  std::filesystem::remove(folder);
  ASSERT_FALSE(list.has_value());
  EXPECT_EQ(list.error().code(), StatusCode::kNotFound);
}

TEST(TokenListTest, AnEmptyFileHasNoTokens) {
  const auto file = std::filesystem::temp_directory_path() / StrCat("atlas_tokens_", ::getpid());
  std::ofstream(file).close();
  const auto list = TokenList::Read(file);
  std::filesystem::remove(file);
  ASSERT_TRUE(list.has_value()) << list.error().message();
  EXPECT_EQ(list->Find(HashOfToken(""), 0).error().code(), StatusCode::kPermissionDenied);
}

}  // namespace
}  // namespace atlas
