#include "server/base/log_format.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <string>

#include <spdlog/pattern_formatter.h>

#include "server/base/json_string.h"
#include "server/base/log_line.h"

namespace atlas {
namespace {

using spdlog::memory_buf_t;
using spdlog::details::log_msg;

std::string_view PayloadOf(const log_msg& line) {
  return {line.payload.data(), line.payload.size()};
}

class TextFormatter final : public spdlog::formatter {
 public:
  void format(const log_msg& line, memory_buf_t& out) override {
    log_msg readable = line;
    if (const auto parts = SplitLogLine(PayloadOf(line))) {
      readable.payload = {parts->sentence.data(), parts->sentence.size()};
    }
    pattern_.format(readable, out);
    line.color_range_start = readable.color_range_start;
    line.color_range_end = readable.color_range_end;
  }
  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<TextFormatter>();
  }

 private:
  spdlog::pattern_formatter pattern_;
};

std::string TimeText(spdlog::log_clock::time_point time) {
  const auto since_1970 = time.time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(since_1970);
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(since_1970 - seconds);
  const auto unix_s = static_cast<std::time_t>(seconds.count());
  std::tm utc{};
  ::gmtime_r(&unix_s, &utc);
  std::array<char, 32> day{};
  std::strftime(day.data(), day.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%s.%03dZ", day.data(), static_cast<int>(ms.count()));
  return text.data();
}

class JsonFormatter final : public spdlog::formatter {
 public:
  void format(const log_msg& line, memory_buf_t& out) override {
    const auto level = spdlog::level::to_string_view(line.level);
    std::string object = "{\"time\":\"" + TimeText(line.time) + "\",\"level\":\"";
    object.append(level.data(), level.size()).append("\",");
    if (const auto parts = SplitLogLine(PayloadOf(line))) {
      object += parts->members;
    } else {
      object += "\"message\":";
      AppendJsonString(PayloadOf(line), object);
    }
    object += "}\n";
    out.append(object.data(), object.data() + object.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonFormatter>();
  }
};

}  // namespace

std::optional<LogFormat> LogFormatByName(std::string_view name) {
  if (name == "text") {
    return LogFormat::kText;
  }
  if (name == "json") {
    return LogFormat::kJson;
  }
  return std::nullopt;
}

std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format) {
  if (format == LogFormat::kJson) {
    return std::make_unique<JsonFormatter>();
  }
  return std::make_unique<TextFormatter>();
}

}  // namespace atlas
