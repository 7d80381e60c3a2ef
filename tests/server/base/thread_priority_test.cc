#include "server/base/thread_priority.h"

#include <algorithm>
#include <thread>

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

}  // namespace
}  // namespace atlas
