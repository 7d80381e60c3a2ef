#include "client/merge/plan/rejected_closures.h"

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using testing::At;
using testing::Found;

TEST(RejectedClosuresTest, WhatIsBelievedInTheEndIsNone) {
  RejectedClosures rejected;
  rejected.Note({Found({0, 1}, {1, 1}, At(1.0)), Found({0, 0}, {1, 0}, At(1.0))});
  rejected.Note({Found({0, 1}, {1, 1}, At(2.0)), Found({0, 2}, {1, 2}, At(1.0))});
  const auto left = rejected.Without({Found({0, 0}, {1, 0}, At(3.0))});
  ASSERT_EQ(left.size(), 2U);
  EXPECT_EQ(left[0].a, (SubmapRef{0, 1}));
  EXPECT_EQ(left[0].match.T_a_b.translation().x(), 2.0) << "as it was found later";
  EXPECT_EQ(left[1].a, (SubmapRef{0, 2}));
}

}  // namespace
}  // namespace atlas
