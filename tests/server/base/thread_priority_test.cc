#include "server/base/thread_priority.h"

#include <algorithm>
#include <thread>

#include <gtest/gtest.h>
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

}  // namespace
}  // namespace atlas
