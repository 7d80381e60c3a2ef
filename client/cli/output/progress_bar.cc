#include "client/cli/output/progress_bar.h"

#include <algorithm>
#include <utility>

namespace atlas {
namespace {

constexpr int kBarCells = 32;

}  // namespace

ProgressBar::ProgressBar(std::ostream& out, bool is_terminal, std::string label, std::size_t total)
    : out_(out), is_terminal_(is_terminal), label_(std::move(label)), total_(total) {}

ProgressBar::~ProgressBar() {
  if (drawn_percent_ >= 0) out_ << "\r\033[K" << std::flush;
}

void ProgressBar::Update(std::size_t done) {
  if (!is_terminal_ || total_ == 0) return;
  const int percent = static_cast<int>(100 * std::min(done, total_) / total_);
  if (percent == drawn_percent_) return;
  drawn_percent_ = percent;
  const auto full = static_cast<std::size_t>(percent * kBarCells / 100);
  out_ << '\r' << label_ << " [" << std::string(full, '#')
       << std::string(static_cast<std::size_t>(kBarCells) - full, '.') << "] " << percent << " %  "
       << std::min(done, total_) << '/' << total_ << std::flush;
}

}  // namespace atlas
