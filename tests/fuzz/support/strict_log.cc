#include "tests/fuzz/support/strict_log.h"

#include <algorithm>
#include <memory>
#include <mutex>
#include <string_view>
#include <utility>

#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include "server/base/log_format.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

class StrictSink : public spdlog::sinks::base_sink<std::mutex> {
 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    const std::string_view text(line.data(), line.size());
    Require(text.starts_with('{') && text.ends_with("}\n"), "a line of the log is an object");
    Require(std::none_of(text.begin(), text.end() - 1,
                         [](char c) { return static_cast<unsigned char>(c) < 0x20; }),
            "a line of the log is one line");
  }
  void flush_() override {}
};

}  // namespace

void UseStrictLog() {
  auto log = std::make_shared<spdlog::logger>("fuzz", std::make_shared<StrictSink>());
  log->set_formatter(MakeLogFormatter(LogFormat::kJson));
  log->set_level(spdlog::level::debug);
  spdlog::set_default_logger(std::move(log));
}

}  // namespace atlas::fuzz
