#include "client/cli/commands/merge/merge_progress.h"

namespace atlas {
namespace {

constexpr std::chrono::seconds kTellEvery{60};  // as `atlas-merge serve` does

}  // namespace

Status MergeProgressBar::operator()(std::string_view step, std::size_t done, std::size_t all) {
  if (step != step_ || all != all_) {
    bar_.reset();
    step_ = step;
    all_ = all;
    bar_.emplace(context_.err, context_.is_err_terminal, step_, all);
  }
  bar_->Update(done);
  if (!context_.is_err_terminal) Tell(done);
  return interruption_.Check();
}

void MergeProgressBar::Tell(std::size_t done) {
  const Clock::time_point now = now_();
  if (now - told_ < kTellEvery) return;
  told_ = now;
  context_.err << "note: " << step_ << ": " << done << " of " << all_ << std::endl;
}

}  // namespace atlas
