#include "server/base/thread_priority.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>

namespace atlas {
namespace {

int NiceOfThisThread() {
  return ::getpriority(PRIO_PROCESS, 0);
}

TEST(ThreadPriorityTest, OneThreadStandsBackAndTheOthersDoNot) {
  const int before = NiceOfThisThread();
  int inside = before;
  std::thread([&inside] {
    EXPECT_TRUE(YieldToOthers(2));
    inside = NiceOfThisThread();
  }).join();
  EXPECT_EQ(inside, std::min(before + 2, 19));
  EXPECT_EQ(NiceOfThisThread(), before);
}

TEST(ThreadPriorityTest, TheNicestGetsWhatNobodyElseWants) {
  int policy = SCHED_OTHER;
  std::thread([&policy] {
    EXPECT_TRUE(YieldToOthers(19));
    policy = ::sched_getscheduler(0);
  }).join();
  EXPECT_EQ(policy, SCHED_IDLE);
  EXPECT_EQ(::sched_getscheduler(0), SCHED_OTHER);
}

// More threads than cores, each at work for a while: some of them wait.
TEST(ThreadPriorityTest, WhoWaitsForACoreKnowsHowLong) {
  if (!std::ifstream("/proc/thread-self/schedstat")) {
    GTEST_SKIP() << "the system does not say";
  }
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(200);
  std::atomic<std::int64_t> waited_ns = 0;
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < 2 * cores; ++i) {
      threads.emplace_back([&] {
        while (std::chrono::steady_clock::now() < end) {
        }
        waited_ns += TimeWithoutCore().count();
      });
    }
  }
  // 200 ms of a core each are missing, for half of the threads.
  EXPECT_GT(waited_ns, static_cast<std::int64_t>(cores) * 100'000'000);
}

}  // namespace
}  // namespace atlas
