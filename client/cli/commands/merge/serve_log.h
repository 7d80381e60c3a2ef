// The log of a program that runs for as long as it is let, as the daemon writes its own: a line an
// event, for people or as a JSON object.
#pragma once

#include <mutex>
#include <ostream>
#include <string>
#include <string_view>
#include <utility>

#include <boost/json/object.hpp>

namespace atlas {

enum class ServeLogLevel { kInfo, kWarning, kError };

// Any thread. `out` outlives it.
class ServeLog {
 public:
  ServeLog(std::ostream& out, std::string program, bool is_json)
      : out_(out), program_(std::move(program)), is_json_(is_json) {}

  // Text: `[date time] [program] [level] message`, local time, control characters as '?'. JSON:
  // `time` (RFC 3339, UTC, milliseconds), `level`, `message`, and `fields`, each at its end.
  void Line(ServeLogLevel level, std::string_view message, const boost::json::object& fields);

 private:
  std::mutex mutex_;
  std::ostream& out_;
  std::string program_;
  bool is_json_;
};

// RFC 3339, UTC, with milliseconds: of now.
std::string NowText();

}  // namespace atlas
