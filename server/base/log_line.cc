#include "server/base/log_line.h"

#include <algorithm>
#include <cstddef>

#include "server/base/json_string.h"

namespace atlas {
namespace {

// Stands before each part. No other line begins with it: those begin with words of the daemon.
constexpr char kMark = '\x1F';
constexpr std::size_t kMaxSentenceBytes = 500;  // peers may have a say in it

}  // namespace

LogLine::LogLine(std::string_view sentence, std::string_view message) {
  text_ = kMark;
  text_ += sentence.substr(0, kMaxSentenceBytes);
  std::replace_if(
      text_.begin() + 1, text_.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, '?');
  text_ += kMark;
  text_ += "\"message\":";
  AppendJsonString(message.substr(0, kMaxSentenceBytes), text_);
}

LogLine& LogLine::Add(std::string_view key, std::string_view value) {
  text_.append(",\"").append(key).append("\":");
  AppendJsonString(value, text_);
  return *this;
}

LogLine& LogLine::Add(std::string_view key, std::uint64_t value) {
  text_.append(",\"").append(key).append("\":").append(std::to_string(value));
  return *this;
}

std::optional<LogLineParts> SplitLogLine(std::string_view text) {
  if (text.empty() || text.front() != kMark) {
    return std::nullopt;
  }
  text.remove_prefix(1);
  const std::size_t end = text.find(kMark);
  if (end == std::string_view::npos) {
    return std::nullopt;
  }
  return LogLineParts{text.substr(0, end), text.substr(end + 1)};
}

}  // namespace atlas
