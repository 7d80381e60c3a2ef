// What is counted per thread, and how much of it the log takes.
#include <chrono>

#include <gtest/gtest.h>

#include "server/base/duration_histogram.h"
#include "server/base/line_budget.h"
#include "server/base/repeated_line.h"

namespace atlas {
namespace {

using std::chrono::microseconds;
using std::chrono::seconds;

TEST(DurationHistogramTest, ABoundBelongsToItsOwnClass) {
  DurationHistogram histogram;
  histogram.Add(microseconds(0));
  histogram.Add(microseconds(250));
  histogram.Add(microseconds(251));
  histogram.Add(seconds(60));
  histogram.Add(seconds(61));
  DurationFigures figures;
  histogram.AddTo(figures);
  EXPECT_EQ(figures.counts.front(), 2u);
  EXPECT_EQ(figures.counts[1], 1u);
  EXPECT_EQ(figures.counts[kDurationBounds_s.size() - 1], 1u);
  EXPECT_EQ(figures.counts.back(), 1u);
  EXPECT_EQ(figures.count(), 5u);
  EXPECT_NEAR(figures.sum_s, 121.000501, 1e-9);
}

TEST(DurationHistogramTest, ThreadsAddUp) {
  DurationHistogram one;
  DurationHistogram other;
  one.Add(seconds(1));
  other.Add(seconds(2));
  DurationFigures figures;
  one.AddTo(figures);
  other.AddTo(figures);
  EXPECT_EQ(figures.count(), 2u);
  EXPECT_DOUBLE_EQ(figures.sum_s, 3.0);
}

TEST(LineBudgetTest, LeavesOutWhatIsTooMuchAndSaysHowMuchThatWas) {
  LineBudget budget(2);
  const LineBudget::Clock::time_point begin{seconds(1'000)};
  EXPECT_EQ(budget.Take(begin), 0u);
  EXPECT_EQ(budget.Take(begin), 0u);
  EXPECT_EQ(budget.Take(begin), std::nullopt);
  EXPECT_EQ(budget.Take(begin + std::chrono::milliseconds(999)), std::nullopt);
  EXPECT_EQ(budget.Take(begin + seconds(1)), 2u);
  EXPECT_EQ(budget.Take(begin + seconds(1)), 0u);
}

TEST(RepeatedLineTest, IsSaidOnceForEachReasonAndCountedUntilItIsOver) {
  RepeatedLine line;
  EXPECT_EQ(line.Succeeds(), 0u);
  EXPECT_TRUE(line.Fails("full"));
  EXPECT_FALSE(line.Fails("full"));
  EXPECT_TRUE(line.Fails("read-only"));
  EXPECT_FALSE(line.Fails("read-only"));
  EXPECT_EQ(line.Succeeds(), 4u);
  EXPECT_EQ(line.Succeeds(), 0u);
  EXPECT_TRUE(line.Fails("read-only")) << "it is news again";
}

}  // namespace
}  // namespace atlas
