#include "client/cli/commands/merge/serve_log.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>

#include "client/cli/output/json_text.h"

namespace atlas {
namespace {

const char* NameOf(ServeLogLevel level) {
  switch (level) {
    case ServeLogLevel::kInfo:
      return "info";
    case ServeLogLevel::kWarning:
      return "warning";
    case ServeLogLevel::kError:
      return "error";
  }
  return "";
}

// `format` to the second, then milliseconds.
std::string TimeText(bool is_utc, const char* format) {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(since_1970);
  const auto ms = std::chrono::floor<std::chrono::milliseconds>(since_1970 - seconds);
  const auto unix_s = static_cast<std::time_t>(seconds.count());
  std::tm parts{};
  is_utc ? gmtime_r(&unix_s, &parts) : localtime_r(&unix_s, &parts);
  std::array<char, 32> text{};
  const std::size_t size = std::strftime(text.data(), text.size(), format, &parts);
  std::array<char, 8> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03d", static_cast<int>(ms.count()));
  return std::string(text.data(), size) + fraction.data();
}

}  // namespace

std::string NowText() {
  return TimeText(true, "%Y-%m-%dT%H:%M:%S") + "Z";
}

void ServeLog::Line(ServeLogLevel level,
                    std::string_view message,
                    const boost::json::object& fields) {
  std::string line;
  if (is_json_) {
    boost::json::object json{{"time", NowText()}, {"level", NameOf(level)}, {"message", message}};
    for (const auto& field : fields) {
      json.insert(field);
    }
    line = JsonText(json);
  } else {
    line = "[" + TimeText(false, "%Y-%m-%d %H:%M:%S") + "] [" + program_ + "] [" + NameOf(level) +
           "] ";
    line.append(message);
    std::replace_if(
        line.begin(), line.end(),
        [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, '?');
  }
  const std::lock_guard lock(mutex_);
  out_ << line << '\n' << std::flush;
}

}  // namespace atlas
