// How the lines of the log are written: for people, or one JSON object each.
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include <spdlog/formatter.h>

namespace atlas {

enum class LogFormat { kText, kJson };

std::optional<LogFormat> LogFormatByName(std::string_view name);

// Text: `[date time] [name] [level] message`. JSON: `time` (RFC 3339, UTC, with milliseconds),
// `level`, `message`, and the fields of a LogLine.
std::unique_ptr<spdlog::formatter> MakeLogFormatter(LogFormat format);

}  // namespace atlas
