// Calls back once when it lives longer than a time. For one thread: after it is destroyed the call
// cannot come any more, not even if the time had just passed.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

namespace atlas {

class Watchdog {
 public:
  Watchdog(const boost::asio::any_io_executor& executor,
           std::chrono::milliseconds time,
           std::function<void()> bite)
      : timer_(executor, time), bite_(std::make_shared<std::function<void()>>(std::move(bite))) {
    timer_.async_wait([weak = std::weak_ptr(bite_)](const boost::system::error_code& cancelled) {
      if (const auto call = weak.lock(); call && !cancelled) {
        (*call)();
      }
    });
  }
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  ~Watchdog() = default;

 private:
  boost::asio::steady_timer timer_;
  std::shared_ptr<std::function<void()>> bite_;
};

}  // namespace atlas
