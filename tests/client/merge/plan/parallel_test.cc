#include "client/merge/plan/parallel.h"

#include <atomic>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/str_cat.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

TEST(ParallelTest, RunsEachOnce) {
  for (const std::size_t count : {0U, 1U, 2U, 3U, 100U}) {
    for (const std::size_t workers : {1U, 2U, 3U, 8U}) {
      std::vector<std::atomic<int>> runs(count);
      const Status status = RunParallel(count, workers, [&](std::size_t worker, std::size_t i) {
        EXPECT_LT(worker, workers);
        ++runs[i];
        return Status();
      });
      EXPECT_TRUE(status.ok());
      for (const std::atomic<int>& times : runs) EXPECT_EQ(times, 1) << count << " " << workers;
    }
  }
}

TEST(ParallelTest, OneWorkerGoesInOrderOnTheCallersThread) {
  std::vector<std::size_t> order;
  const auto caller = std::this_thread::get_id();
  const Status status = RunParallel(5, 1, [&](std::size_t worker, std::size_t i) {
    EXPECT_EQ(worker, 0U);
    EXPECT_EQ(std::this_thread::get_id(), caller);
    order.push_back(i);
    return Status();
  });
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
}

// What a worker keeps needs no lock: only one thread is it.
TEST(ParallelTest, AWorkerIsOneThread) {
  std::mutex mutex;
  std::vector<std::set<std::thread::id>> threads(3);
  std::vector<int> runs(3, 0);
  const Status status = RunParallel(300, 3, [&](std::size_t worker, std::size_t) {
    ++runs[worker];
    const std::lock_guard lock(mutex);
    threads[worker].insert(std::this_thread::get_id());
    return Status();
  });
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(runs[0] + runs[1] + runs[2], 300);
  for (const auto& of_worker : threads) EXPECT_LE(of_worker.size(), 1U);
}

TEST(ParallelTest, ThereAreNoMoreWorkersThanWork) {
  std::mutex mutex;
  std::set<std::size_t> workers;
  const Status status = RunParallel(2, 50, [&](std::size_t worker, std::size_t) {
    const std::lock_guard lock(mutex);
    workers.insert(worker);
    return Status();
  });
  EXPECT_TRUE(status.ok());
  for (const std::size_t worker : workers) EXPECT_LT(worker, 2U);
}

TEST(ParallelTest, AnErrorEndsIt) {
  std::vector<std::size_t> ran;
  const Status status = RunParallel(100, 1, [&](std::size_t, std::size_t i) -> Status {
    ran.push_back(i);
    return i == 3 ? Status(StatusCode::kTimeout, "3") : Status();
  });
  EXPECT_EQ(status, Status(StatusCode::kTimeout, "3"));
  EXPECT_EQ(ran, (std::vector<std::size_t>{0, 1, 2, 3}));
}

// Whoever is faster, the error is that of the least.
TEST(ParallelTest, TheErrorIsOfTheLeastThatFailed) {
  for (std::uint32_t round = 0; round < testing::Scaled(200); ++round) {
    const Status status = RunParallel(40, 4, [&](std::size_t, std::size_t i) -> Status {
      return i >= 5 ? Status(StatusCode::kInvalidData, StrCat(i)) : Status();
    });
    ASSERT_EQ(status, Status(StatusCode::kInvalidData, "5"));
  }
}

// The second fails at once, the first only when the second has.
TEST(ParallelTest, AnEarlierOneThatFailsLaterCounts) {
  std::atomic<bool> has_failed{false};
  const Status status = RunParallel(2, 2, [&](std::size_t, std::size_t i) -> Status {
    if (i == 0) {
      has_failed.wait(false);
      return {StatusCode::kInvalidData, "first"};
    }
    has_failed = true;
    has_failed.notify_all();
    return {StatusCode::kInvalidData, "second"};
  });
  EXPECT_EQ(status.message(), "first");
}

}  // namespace
}  // namespace atlas
