// Work that takes long, of several names: whose turn it is, and what happens when none comes.
#include "server/net/requests/fair_pool.h"

#include <chrono>
#include <future>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>
#include <gtest/gtest.h>

namespace atlas {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;
using std::chrono::seconds;

class FairPoolTest : public ::testing::Test {
 protected:
  ~FairPoolTest() override {
    work_.reset();
    thread_.join();
  }
  std::future<Result<int>> Run(FairPool& pool,
                               const char& whose,
                               Blocking<int> call,
                               FairPool::Deadline deadline = std::nullopt) {
    return asio::co_spawn(io_, pool.Run<int>(&whose, deadline, std::move(call)), asio::use_future);
  }
  // Holds its thread until it is let go.
  Blocking<int> Hold() {
    return [this] {
      began_.set_value();
      go_.get_future().wait();
      return 0;
    };
  }
  Blocking<int> Note(int number) {
    return [this, number] {
      done_.push_back(number);
      return number;
    };
  }
  static bool IsReady(const std::future<Result<int>>& answer, milliseconds patience) {
    return answer.wait_for(patience) == std::future_status::ready;
  }

  const char alice_ = 'a';
  const char bob_ = 'b';
  std::promise<void> began_;
  std::promise<void> go_;
  std::vector<int> done_;  // in their order
  asio::io_context io_;
  std::optional<asio::io_context::work> work_{io_};
  std::thread thread_{[this] {
    io_.run();
  }};
};

TEST_F(FairPoolTest, OneDoesNotTakeAllThreads) {
  FairPool pool(2, 1);
  auto held = Run(pool, alice_, Hold());
  began_.get_future().wait();
  auto second = Run(pool, alice_, Note(1));
  auto bobs = Run(pool, bob_, Note(2));
  EXPECT_EQ(bobs.get().value(), 2);
  EXPECT_FALSE(IsReady(second, milliseconds(50))) << "her first one has her thread";
  go_.set_value();
  EXPECT_EQ(held.get().value(), 0);
  EXPECT_EQ(second.get().value(), 1);
  EXPECT_EQ(done_, (std::vector<int>{2, 1}));
}

TEST_F(FairPoolTest, WhoComesLastWaitsForOneOfEachOther) {
  FairPool pool(1, 1);
  auto held = Run(pool, alice_, Hold());
  began_.get_future().wait();
  auto first = Run(pool, alice_, Note(1));
  auto second = Run(pool, alice_, Note(2));
  auto bobs = Run(pool, bob_, Note(3));
  EXPECT_FALSE(IsReady(bobs, milliseconds(50)));
  go_.set_value();
  second.wait();
  bobs.wait();
  EXPECT_EQ(done_, (std::vector<int>{3, 1, 2})) << "she had her turn";
}

TEST_F(FairPoolTest, WhatIsLateNeverRuns) {
  FairPool pool(1, 1);
  auto held = Run(pool, alice_, Hold());
  began_.get_future().wait();
  auto late = Run(pool, bob_, Note(1), std::chrono::steady_clock::now() + milliseconds(20));
  ASSERT_TRUE(IsReady(late, seconds(30))) << "nobody has let go of the thread";
  EXPECT_EQ(late.get().error().code(), StatusCode::kTimeout);
  auto next = Run(pool, bob_, Note(2));
  go_.set_value();
  EXPECT_EQ(next.get().value(), 2);
  EXPECT_EQ(done_, std::vector<int>{2});
}

TEST_F(FairPoolTest, WhatHasBegunInTimeIsWaitedFor) {
  FairPool pool(1, 1);
  auto held = Run(pool, alice_, Hold(), std::chrono::steady_clock::now() + milliseconds(200));
  began_.get_future().wait();
  EXPECT_FALSE(IsReady(held, milliseconds(300)));
  go_.set_value();
  EXPECT_EQ(held.get().value(), 0);
}

TEST_F(FairPoolTest, WhatIsThrownIsAnError) {
  FairPool pool(1, 1);
  const Blocking<int> fails = []() -> Result<int> {
    throw std::runtime_error("broken");
  };
  EXPECT_EQ(Run(pool, alice_, fails).get().error().code(), StatusCode::kInternal);
  EXPECT_EQ(Run(pool, alice_, Note(1)).get().value(), 1);
}

}  // namespace
}  // namespace atlas
