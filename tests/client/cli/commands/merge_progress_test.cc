#include "client/cli/commands/merge/merge_progress.h"

#include <sstream>

#include <gtest/gtest.h>

namespace atlas {
namespace {

using std::chrono::seconds;

// What is told of a step at each of these times after the beginning.
std::string ToldAt(std::initializer_list<int> times_s, bool is_terminal) {
  std::ostringstream out;
  std::ostringstream err;
  CommandContext context{
      .out = out, .err = err, .is_err_terminal = is_terminal, .connection = {}, .atlas_file = {}};
  MergeProgressBar::Clock::time_point now;
  MergeProgressBar progress(context, [&] { return now; });
  std::size_t done = 0;
  for (const int time_s : times_s) {
    now = MergeProgressBar::Clock::time_point(seconds(time_s));
    EXPECT_TRUE(progress("submaps", ++done, 9).ok());
  }
  EXPECT_EQ(out.str(), "");
  return err.str();
}

TEST(MergeProgressBarTest, WithoutATerminalALineAMinuteIsTold) {
  EXPECT_EQ(ToldAt({1, 59}, false), "");
  EXPECT_EQ(ToldAt({1, 61, 62, 120, 130}, false), "note: submaps: 2 of 9\nnote: submaps: 5 of 9\n");
}

TEST(MergeProgressBarTest, OnATerminalThereIsABar) {
  const std::string told = ToldAt({1, 61}, true);
  EXPECT_NE(told.find("submaps ["), std::string::npos);
  EXPECT_EQ(told.find("note:"), std::string::npos);
}

}  // namespace
}  // namespace atlas
