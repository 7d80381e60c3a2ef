#include "server/hangup_watch.h"

#include <csignal>
#include <thread>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>

namespace atlas {

class HangupWatch::Impl {
 public:
  explicit Impl(std::function<void()> on_hangup)
      : on_hangup_(std::move(on_hangup)), signals_(io_, SIGHUP) {
    Wait();
    thread_ = std::thread([this] { io_.run(); });
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    io_.stop();
    thread_.join();
  }

 private:
  void Wait() {
    signals_.async_wait([this](const boost::system::error_code& error, int /*signal*/) {
      if (!error) {
        on_hangup_();
        Wait();
      }
    });
  }

  std::function<void()> on_hangup_;
  boost::asio::io_context io_{1};
  boost::asio::signal_set signals_;
  std::thread thread_;
};

HangupWatch::HangupWatch(std::function<void()> on_hangup)
    : impl_(std::make_unique<Impl>(std::move(on_hangup))) {}
HangupWatch::~HangupWatch() = default;

}  // namespace atlas
