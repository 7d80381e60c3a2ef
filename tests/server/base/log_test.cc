// Lines for people and lines for programs, whatever peers say in them.
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/details/log_msg.h>

#include "server/base/json_string.h"
#include "server/base/log_format.h"
#include "server/base/log_line.h"

namespace atlas {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

std::string Json(std::string_view text) {
  std::string out;
  AppendJsonString(text, out);
  return out;
}

std::string Formatted(LogFormat format, const std::string& payload) {
  spdlog::details::log_msg line("atlasd", spdlog::level::warn, payload);
  line.time = spdlog::log_clock::time_point(std::chrono::milliseconds(1'700'000'000'007));
  spdlog::memory_buf_t out;
  MakeLogFormatter(format)->format(line, out);
  return {out.data(), out.size()};
}

TEST(JsonStringTest, EscapesWhatJsonDoesNotAllow) {
  EXPECT_EQ(Json("a\"b\\c\n\t\x01\x7F"), R"("a\"b\\c\u000a\u0009\u0001\u007f")");
  EXPECT_EQ(Json(std::string_view("\0", 1)), R"("\u0000")");
  EXPECT_EQ(Json("Grüße € 𝄞"), "\"Grüße € 𝄞\"");
}

TEST(JsonStringTest, ReplacesWhatIsNoUtf8) {
  EXPECT_EQ(Json("a\xFF"
                 "b"),
            "\"a\\ufffdb\"");
  EXPECT_EQ(Json("\xC0\x80"), "\"\\ufffd\\ufffd\"");                        // a long way to say 0
  EXPECT_EQ(Json("\xED\xA0\x80"), "\"\\ufffd\\ufffd\\ufffd\"");             // half of a pair
  EXPECT_EQ(Json("\xF4\x90\x80\x80"), "\"\\ufffd\\ufffd\\ufffd\\ufffd\"");  // beyond the last
  EXPECT_EQ(Json("\xE2\x82"), "\"\\ufffd\\ufffd\"");                        // cut off
}

TEST(LogFormatTest, AJsonLineIsOneObjectWithItsTimeInUtc) {
  EXPECT_EQ(Formatted(LogFormat::kJson, "the \"disk\"\nis full"),
            "{\"time\":\"2023-11-14T22:13:20.007Z\",\"level\":\"warning\","
            "\"message\":\"the \\\"disk\\\"\\u000ais full\"}\n");
}

TEST(LogFormatTest, FieldsOfALineAreMembers) {
  LogLine line("1.2.3.4:5: it failed", "it failed");
  line.Add("client", "x\"y").Add("request_id", std::uint64_t{18'446'744'073'709'551'615u});
  EXPECT_THAT(Formatted(LogFormat::kJson, line.text()),
              EndsWith("\"message\":\"it failed\",\"client\":\"x\\\"y\","
                       "\"request_id\":18446744073709551615}\n"));
}

TEST(LogFormatTest, ATextLineIsTheSentence) {
  LogLine line("1.2.3.4:5: it failed", "it failed");
  line.Add("client", "x");
  EXPECT_THAT(Formatted(LogFormat::kText, line.text()),
              EndsWith("[atlasd] [warning] 1.2.3.4:5: it failed\n"));
  EXPECT_THAT(Formatted(LogFormat::kText, "as it is"), EndsWith("[atlasd] [warning] as it is\n"));
}

TEST(LogFormatTest, APeerCannotForgeALineOrAField) {
  const LogLine line("a\n[error] b\x1F\"level\":\"x\"", "a\x1F\"level\":\"x\"");
  EXPECT_THAT(Formatted(LogFormat::kText, line.text()),
              EndsWith("[warning] a?[error] b?\"level\":\"x\"\n"));
  EXPECT_THAT(Formatted(LogFormat::kJson, line.text()),
              HasSubstr(R"("message":"a\u001f\"level\":\"x\"")"));
  EXPECT_THAT(Formatted(LogFormat::kJson, "words \x1F\"level\":\"x\""),
              HasSubstr(R"("message":"words \u001f\"level\":\"x\"")"));
}

TEST(LogFormatTest, KnowsItsNames) {
  EXPECT_EQ(LogFormatByName("text"), LogFormat::kText);
  EXPECT_EQ(LogFormatByName("json"), LogFormat::kJson);
  EXPECT_EQ(LogFormatByName("xml"), std::nullopt);
}

}  // namespace
}  // namespace atlas
