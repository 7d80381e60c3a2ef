// How many lines of one sort the log takes: who causes them shall not fill the disk. For one
// thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/str_cat.h"

namespace atlas {

class LineBudget {
 public:
  using Clock = std::chrono::steady_clock;

  explicit LineBudget(std::uint64_t max_lines_per_s) : max_lines_(max_lines_per_s) {}

  // How many were left out since the last one that was written; nullopt: leave this one out, too.
  std::optional<std::uint64_t> Take(Clock::time_point now) {
    if (now - began_ >= std::chrono::seconds(1)) {
      began_ = now;
      lines_ = 0;
    }
    if (lines_ == max_lines_) {
      ++left_out_;
      return std::nullopt;
    }
    ++lines_;
    const std::uint64_t left_out = left_out_;
    left_out_ = 0;
    return left_out;
  }
  // To end the line with that comes after those that were left out.
  static std::string LeftOutText(std::uint64_t left_out) {
    return left_out == 0 ? "" : StrCat("; ", left_out, " more such lines were left out");
  }

 private:
  std::uint64_t max_lines_;
  std::uint64_t lines_ = 0;  // in the second that began then
  std::uint64_t left_out_ = 0;
  Clock::time_point began_;
};

}  // namespace atlas
