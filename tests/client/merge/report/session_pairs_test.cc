#include "client/merge/report/session_pairs.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

FoundClosure Of(std::size_t a, std::size_t b) {
  return {{a, 0}, {b, 1}, {}};
}

TEST(SessionPairsTest, EachTwoSessionsHaveTheirOwnFigures) {
  MergePlan plan;
  plan.closures = {Of(1, 2), Of(0, 1), Of(0, 1)};
  plan.closure_off_m = {0.5, 0.03, 0.04};
  plan.closure_off_rad = {0.1, 0.0, 0.0};
  plan.rejected_closures = {{Of(0, 1)}, {Of(2, 2)}, {Of(2, 2)}};
  const std::vector<PairOutcome> pairs = PairsOf(plan);
  ASSERT_EQ(pairs.size(), 3U);
  EXPECT_EQ(pairs[0].a, 0U);
  EXPECT_EQ(pairs[0].b, 1U);
  EXPECT_EQ(pairs[0].closures, 2U);
  EXPECT_NEAR(pairs[0].off_m, 0.0353553, 1e-6);
  EXPECT_EQ(pairs[0].rejected, 1U);
  EXPECT_EQ(pairs[1].closures, 1U);
  EXPECT_DOUBLE_EQ(pairs[1].off_m, 0.5);
  EXPECT_DOUBLE_EQ(pairs[1].off_rad, 0.1);
  EXPECT_EQ(pairs[1].rejected, 0U);
  EXPECT_EQ(pairs[2].a, pairs[2].b) << "two visits of one";
  EXPECT_EQ(pairs[2].closures, 0U);
  EXPECT_EQ(pairs[2].rejected, 2U);
}

TEST(SessionPairsTest, OfNothingThereIsNoPair) {
  EXPECT_TRUE(PairsOf({}).empty());
  EXPECT_EQ(RootMeanSquare({}), 0.0);
}

}  // namespace
}  // namespace atlas
