// A value that another thread delivers to a coroutine, once.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/base/status.h"

namespace atlas {

// Made and awaited on `executor` (a single thread); Set() may be called from any thread.
template <typename T>
class OneShot : public std::enable_shared_from_this<OneShot<T>> {
 public:
  explicit OneShot(boost::asio::any_io_executor executor)
      : executor_(std::move(executor)),
        timer_(executor_, boost::asio::steady_timer::time_point::max()) {}

  void Set(Result<T> value) {
    boost::asio::post(executor_,
                      [self = this->shared_from_this(), value = std::move(value)]() mutable {
                        self->value_ = std::move(value);
                        self->timer_.cancel();
                      });
  }

  // Whether it is there by then.
  boost::asio::awaitable<bool> WaitUntil(boost::asio::steady_timer::time_point deadline) {
    timer_.expires_at(deadline);
    while (!value_ && boost::asio::steady_timer::clock_type::now() < deadline) {
      boost::system::error_code ignored;  // the time is over, or it is there
      co_await timer_.async_wait(boost::asio::redirect_error(boost::asio::use_awaitable, ignored));
    }
    timer_.expires_at(boost::asio::steady_timer::time_point::max());
    co_return value_.has_value();
  }

  boost::asio::awaitable<Result<T>> Take() {
    while (!value_) {
      boost::system::error_code ignored;  // the timer only ever ends by being cancelled
      co_await timer_.async_wait(boost::asio::redirect_error(boost::asio::use_awaitable, ignored));
    }
    co_return std::move(*value_);
  }

 private:
  boost::asio::any_io_executor executor_;
  boost::asio::steady_timer timer_;
  std::optional<Result<T>> value_;
};

}  // namespace atlas
