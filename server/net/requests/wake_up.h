// Wakes a coroutine from any thread, any number of times.
#pragma once

#include <chrono>
#include <memory>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace atlas {

// Made and awaited on `executor` (a single thread), by one coroutine.
class WakeUp : public std::enable_shared_from_this<WakeUp> {
 public:
  explicit WakeUp(const boost::asio::any_io_executor& executor)
      : timer_(executor, boost::asio::steady_timer::time_point::max()) {}

  // From any thread.
  void Ring() {
    boost::asio::post(timer_.get_executor(), [self = shared_from_this()] {
      self->is_rung_ = true;
      self->timer_.cancel();
    });
  }

  // Until it rings; at once if it did since the last time.
  boost::asio::awaitable<void> Wait() {
    while (!is_rung_) {
      boost::system::error_code ignored;  // woken by cancelling
      co_await timer_.async_wait(boost::asio::redirect_error(boost::asio::use_awaitable, ignored));
    }
    is_rung_ = false;
  }

 private:
  boost::asio::steady_timer timer_;
  bool is_rung_ = false;
};

}  // namespace atlas
