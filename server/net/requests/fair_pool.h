// Threads for work that takes long, shared by those whose it is: each has a line of its own, the
// lines take turns, and one has no more than so many threads at a time, even while others are free:
// work is not interrupted, and who comes next must not find all of them taken by one. Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/net/requests/on_pool.h"
#include "server/net/requests/one_shot.h"

namespace atlas {

class FairPool {
 public:
  using Job = std::function<void()>;  // throws nothing
  using Whose = const void*;          // stands for a name; never followed
  using Deadline = std::optional<std::chrono::steady_clock::time_point>;

  // `max_running`: of one, of `threads`.
  FairPool(std::size_t threads, std::size_t max_running)
      : max_running_(max_running), free_(threads), pool_(threads) {}
  FairPool(const FairPool&) = delete;
  FairPool& operator=(const FairPool&) = delete;
  ~FairPool() { Join(); }

  // Runs `call` when its turn comes. kTimeout: that was not by `deadline`, and it never will. What
  // it throws becomes kInternal.
  template <typename T>
  boost::asio::awaitable<Result<T>> Run(Whose whose, Deadline deadline, Blocking<T> call);

  // Waits for all that was posted.
  void Join() { pool_.join(); }

 private:
  struct Waiting {
    std::uint64_t number = 0;
    Job job;
  };
  struct Line {
    std::deque<Waiting> waiting;
    std::size_t running = 0;
    bool is_ready = false;  // among those whose turn comes
  };

  std::uint64_t Post(Whose whose, Job job);
  // False: it has begun.
  bool Cancel(Whose whose, std::uint64_t number);
  // The rest with the mutex locked.
  void StartNext();
  void Start(Whose whose, Job job);
  void Finish(Whose whose);
  void Settle(Whose whose);

  const std::size_t max_running_;
  std::mutex mutex_;
  std::map<Whose, Line> lines_;
  std::deque<Whose> turns_;  // of lines in which somebody waits and may run
  std::size_t free_;         // threads
  std::uint64_t last_number_ = 0;
  boost::asio::thread_pool pool_;  // the first to go
};

template <typename T>
boost::asio::awaitable<Result<T>> FairPool::Run(Whose whose, Deadline deadline, Blocking<T> call) {
  const auto result = std::make_shared<OneShot<T>>(co_await boost::asio::this_coro::executor);
  const Job job = [result, call = std::move(call)] {
    try {
      result->Set(call());
    } catch (const std::exception& error) {
      result->Set(Error(StatusCode::kInternal, error.what()));
    }
  };
  const std::uint64_t number = Post(whose, job);
  if (deadline) {
    const bool is_there = co_await result->WaitUntil(*deadline);
    if (!is_there && Cancel(whose, number)) {
      co_return Error(StatusCode::kTimeout, "the time was over before a thread was free for it");
    }
  }
  co_return co_await result->Take();
}

}  // namespace atlas
