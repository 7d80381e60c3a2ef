// Where the service says what happened, without knowing a logging library. May be called from any
// thread.
#pragma once

#include <functional>
#include <string>

namespace atlas {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

using LogSink = std::function<void(LogLevel, const std::string&)>;

}  // namespace atlas
