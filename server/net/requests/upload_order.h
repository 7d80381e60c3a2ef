// Uploads of one connection are checked side by side and reach the store in the order in which they
// came, so that the last sequence number that is there tells what else is. For the thread of the
// connection.
#pragma once

#include <cstdint>
#include <set>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace atlas {

class UploadOrder {
 public:
  explicit UploadOrder(boost::asio::any_io_executor executor)
      : changed_(std::move(executor), boost::asio::steady_timer::time_point::max()) {}

  // A place in the line; given up when it is destroyed, whatever became of the upload.
  class Turn {
   public:
    explicit Turn(UploadOrder& order) : order_(order), number_(order.next_++) {}
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    ~Turn() { Leave(); }

    // Until all before have left.
    boost::asio::awaitable<void> Come() {
      while (order_.first_ != number_) {
        boost::system::error_code ignored;  // woken by cancelling
        co_await order_.changed_.async_wait(
            boost::asio::redirect_error(boost::asio::use_awaitable, ignored));
      }
    }
    void Leave() {
      if (!has_left_) {
        has_left_ = true;
        order_.Leave(number_);
      }
    }

   private:
    UploadOrder& order_;
    const std::uint64_t number_;
    bool has_left_ = false;
  };

 private:
  void Leave(std::uint64_t number) {
    left_early_.insert(number);
    while (left_early_.erase(first_) > 0) {
      ++first_;
    }
    changed_.cancel();
  }

  boost::asio::steady_timer changed_;  // cancelled when somebody left
  std::uint64_t next_ = 0;
  std::uint64_t first_ = 0;
  std::set<std::uint64_t> left_early_;  // before their turn: given up
};

}  // namespace atlas
