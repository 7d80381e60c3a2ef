// A progress bar for people: one line on stderr, drawn only when stderr is a terminal.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>

namespace atlas {

class ProgressBar {
 public:
  ProgressBar(std::ostream& out, bool is_terminal, std::string label, std::size_t total);
  ~ProgressBar();  // wipes the line
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ProgressBar(ProgressBar&&) = delete;
  ProgressBar& operator=(ProgressBar&&) = delete;

  // Draws when the bar or the percentage moved.
  void Update(std::size_t done);

 private:
  std::ostream& out_;
  bool is_terminal_;
  std::string label_;
  std::size_t total_;
  int drawn_percent_ = -1;
};

}  // namespace atlas
