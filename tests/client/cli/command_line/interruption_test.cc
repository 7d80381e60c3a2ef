#include "client/cli/command_line/interruption.h"

#include <cstdlib>

#include <gtest/gtest.h>

namespace atlas {
namespace {

class InterruptionDeathTest : public testing::TestWithParam<int> {};

// Exits with 0 only where the signal is lost.
void CleanUpAfter(int number) {
  {
    const Interruption interruption;
    if (!interruption.Check().ok()) std::_Exit(1);
    std::raise(number);
    if (interruption.Check().code() != StatusCode::kUnavailable) std::_Exit(2);
  }
  std::_Exit(0);
}

TEST_P(InterruptionDeathTest, ASignalIsSeenFirstAndEndsTheProcessAfterwards) {
  EXPECT_EXIT(CleanUpAfter(GetParam()), testing::KilledBySignal(GetParam()), "");
}

INSTANTIATE_TEST_SUITE_P(Both, InterruptionDeathTest, testing::Values(SIGINT, SIGTERM));

TEST(InterruptionTest, WhatIsIgnoredStaysIgnoredAndNothingIsLeftBehind) {
  const auto before = std::signal(SIGINT, SIG_IGN);
  {
    const Interruption interruption;
    std::raise(SIGINT);
    EXPECT_TRUE(interruption.Check().ok());
  }
  EXPECT_EQ(std::signal(SIGINT, before), SIG_IGN);
}

}  // namespace
}  // namespace atlas
