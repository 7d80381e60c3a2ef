// How far a merge is, for whoever started it: a bar a step on a terminal, else a line now and then.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "client/cli/command_line/command.h"
#include "client/cli/command_line/interruption.h"
#include "client/cli/output/progress_bar.h"
#include "core/base/status.h"

namespace atlas {

// One call at a time, from any thread. One object at a time, as Interruption.
class MergeProgressBar {
 public:
  using Clock = std::chrono::steady_clock;

  // The context outlives it.
  explicit MergeProgressBar(
      CommandContext& context, std::function<Clock::time_point()> now = [] { return Clock::now(); })
      : context_(context), now_(std::move(now)), told_(now_()) {}

  // kUnavailable: a signal came, and the merge is to end.
  Status operator()(std::string_view step, std::size_t done, std::size_t all);
  void Wipe() { bar_.reset(); }

 private:
  void Tell(std::size_t done);

  CommandContext& context_;
  std::function<Clock::time_point()> now_;
  Interruption interruption_;
  Clock::time_point told_;
  std::string step_;
  std::size_t all_ = 0;
  std::optional<ProgressBar> bar_;
};

}  // namespace atlas
