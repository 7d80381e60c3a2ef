#include "server/service/fusion/worker_pace.h"

#include <thread>

#include <gtest/gtest.h>

namespace atlas {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

class WorkerPaceTest : public ::testing::Test {
 protected:
  milliseconds TimeToRest(const std::stop_token& stop = {}) {
    const auto begin = steady_clock::now();
    pace_.Rest(stop);
    return std::chrono::duration_cast<milliseconds>(steady_clock::now() - begin);
  }

  std::chrono::nanoseconds without_core_{milliseconds(500)};  // from before
  WorkerPace::Options options_{3, milliseconds(1), milliseconds(300)};
  WorkerPace pace_{[this] { return without_core_; }, options_};
};

TEST_F(WorkerPaceTest, WhoIsNotKeptWaitingDoesNotRest) {
  without_core_ += std::chrono::microseconds(900);
  EXPECT_LT(TimeToRest(), milliseconds(300));
}

TEST_F(WorkerPaceTest, RestsLongerThanItWaited) {
  without_core_ += milliseconds(50);
  EXPECT_GE(TimeToRest(), milliseconds(150));
  EXPECT_LT(TimeToRest(), milliseconds(150));  // of the same wait, once
}

TEST_F(WorkerPaceTest, RestsNoLongerThanItMay) {
  without_core_ += std::chrono::hours(1);
  const milliseconds rest = TimeToRest();
  EXPECT_GE(rest, milliseconds(300));
  EXPECT_LT(rest, std::chrono::minutes(1));
}

TEST_F(WorkerPaceTest, AStopEndsTheRest) {
  options_.max_rest = std::chrono::minutes(10);
  pace_ = WorkerPace([this] { return without_core_; }, options_);
  without_core_ += std::chrono::minutes(1);
  std::stop_source stop;
  const std::jthread stopper([&stop] {
    std::this_thread::sleep_for(milliseconds(20));
    stop.request_stop();
  });
  EXPECT_LT(TimeToRest(stop.get_token()), std::chrono::minutes(1));
}

TEST_F(WorkerPaceTest, WhoStandsBackForNobodyNeverRests) {
  options_.rest_to_wait = 0;
  pace_ = WorkerPace([this] { return without_core_; }, options_);
  without_core_ += std::chrono::hours(1);
  EXPECT_LT(TimeToRest(), milliseconds(300));
}

}  // namespace
}  // namespace atlas
