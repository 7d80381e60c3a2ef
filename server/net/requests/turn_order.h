// Requests of one connection whose turn comes in the order in which they did. For the thread of the
// connection.
#pragma once

#include <list>
#include <utility>
#include <variant>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace atlas {

class TurnOrder {
  using Line = std::list<std::monostate>;  // places, the first of them at the front

 public:
  explicit TurnOrder(const boost::asio::any_io_executor& executor)
      : changed_(executor, boost::asio::steady_timer::time_point::max()) {}

  // A place in the line; given up when it is destroyed, whatever became of the request.
  class Turn {
   public:
    explicit Turn(TurnOrder& order)
        : order_(order), place_(order.line_.emplace(order.line_.end())) {}
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    ~Turn() { Leave(); }

    // Until all before have left.
    boost::asio::awaitable<void> Come() {
      while (order_.line_.begin() != place_) {
        boost::system::error_code ignored;  // woken by cancelling
        co_await order_.changed_.async_wait(
            boost::asio::redirect_error(boost::asio::use_awaitable, ignored));
      }
    }
    void Leave() {
      if (!has_left_) {
        has_left_ = true;
        order_.line_.erase(place_);
        boost::system::error_code ignored;  // a timer has none
        order_.changed_.cancel(ignored);
      }
    }

   private:
    TurnOrder& order_;
    const Line::iterator place_;
    bool has_left_ = false;
  };

  bool is_empty() const { return line_.empty(); }

 private:
  boost::asio::steady_timer changed_;  // cancelled when somebody left
  Line line_;
};

}  // namespace atlas
