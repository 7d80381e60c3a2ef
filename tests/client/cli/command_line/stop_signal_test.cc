#include "client/cli/command_line/stop_signal.h"

#include <array>
#include <csignal>
#include <thread>

#include <gtest/gtest.h>
#include <unistd.h>

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// As `kill` sends it: to the process, not to one of its threads.
void SendToProcess(int number) {
  ASSERT_EQ(kill(getpid(), number), 0);
}

// As from a terminal: what is started in the background ignores SIGINT.
class Heeded {
 public:
  Heeded() {
    for (std::size_t i = 0; i < kBoth.size(); ++i) before_[i] = std::signal(kBoth[i], SIG_DFL);
  }
  ~Heeded() {
    for (std::size_t i = 0; i < kBoth.size(); ++i) std::signal(kBoth[i], before_[i]);
  }
  Heeded(const Heeded&) = delete;
  Heeded& operator=(const Heeded&) = delete;
  Heeded(Heeded&&) = delete;
  Heeded& operator=(Heeded&&) = delete;

 private:
  static constexpr std::array kBoth{SIGINT, SIGTERM};
  std::array<void (*)(int), 2> before_{};
};

class StopSignalTest : public testing::TestWithParam<int> {
 private:
  Heeded heeded_;
};

TEST_P(StopSignalTest, ItIsSeenFromAnyThreadAndStays) {
  StopSignal stop;
  EXPECT_FALSE(stop.HasCome());
  SendToProcess(GetParam());
  bool has_come = false;
  std::thread([&] { has_come = stop.HasCome(); }).join();
  EXPECT_TRUE(has_come);
  EXPECT_TRUE(stop.HasCome());
  stop.Sleep(seconds(600));  // there is nothing to wait for
}

TEST_P(StopSignalTest, WhoSleepsIsWoken) {
  StopSignal stop;
  const std::jthread sender([] { SendToProcess(GetParam()); });
  stop.Sleep(seconds(600));
  EXPECT_TRUE(stop.HasCome());
}

INSTANTIATE_TEST_SUITE_P(Both, StopSignalTest, testing::Values(SIGINT, SIGTERM));

TEST(StopSignalOnceTest, WithoutOneASleepIsAsLongAsItIs) {
  StopSignal stop;
  const auto begin = std::chrono::steady_clock::now();
  stop.Sleep(milliseconds(30));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, milliseconds(30));
  EXPECT_FALSE(stop.HasCome());
}

TEST(StopSignalOnceTest, WhatIsIgnoredStaysIgnored) {
  const auto before = std::signal(SIGINT, SIG_IGN);
  {
    StopSignal stop;
    SendToProcess(SIGINT);
    EXPECT_FALSE(stop.HasCome());
  }
  EXPECT_EQ(std::signal(SIGINT, before), SIG_IGN);
}

TEST(StopSignalOnceTest, WhoeverIsToldTwiceEndsWellNevertheless) {
  const Heeded heeded;
  StopSignal stop;
  SendToProcess(SIGTERM);
  EXPECT_TRUE(stop.HasCome());
  SendToProcess(SIGTERM);
  SendToProcess(SIGINT);
}  // and this process is still there

TEST(StopSignalDeathTest, AfterwardsASignalEndsTheProcessAgain) {
  const Heeded heeded;
  { const StopSignal stop; }
  EXPECT_EXIT(std::raise(SIGTERM), testing::KilledBySignal(SIGTERM), "");
}

}  // namespace
}  // namespace atlas
