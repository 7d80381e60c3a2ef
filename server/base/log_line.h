// A line of the log that programs read by its fields and people as a sentence. It travels through
// the logging library as one text; log_format.h takes it apart.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace atlas {

class LogLine {
 public:
  // `sentence` is for people, `message` what the field of this name says.
  LogLine(std::string_view sentence, std::string_view message);

  // A key is a literal of letters; a value any bytes.
  LogLine& Add(std::string_view key, std::string_view value);
  LogLine& Add(std::string_view key, std::uint64_t value);

  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

// A text that was a LogLine.
struct LogLineParts {
  std::string_view sentence;
  std::string_view members;  // of a JSON object, the message first
};

// nullopt: it is only a message.
std::optional<LogLineParts> SplitLogLine(std::string_view text);

}  // namespace atlas
