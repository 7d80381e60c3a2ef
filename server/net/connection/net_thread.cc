#include "server/net/connection/net_thread.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <spdlog/spdlog.h>

namespace atlas {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;

constexpr std::size_t kReadBytes = 64u << 10;

// How often to look for what is late: a quarter of what is waited for, and often enough for people.
milliseconds LookEvery(const NetOptions& options) {
  const milliseconds shortest = std::min(
      {options.handshake, options.idle, options.frame, options.write_stall, options.linger});
  return std::clamp(shortest / 4, milliseconds(1), milliseconds(250));
}

}  // namespace

NetThread::NetThread(RequestHandler& handler, SharedLimits& limits, const NetOptions& options)
    : handler_(handler),
      limits_(limits),
      options_(options),
      buffer_(kReadBytes),
      lines_(options.max_log_lines_per_s),
      connection_places_(options.max_connections),
      work_(asio::make_work_guard(io_)),
      thread_([this] { Run(); }) {}

void NetThread::Serve(PeerConnection::Arrival arrival) {
  // A place here, beside the server's own, only counts: the server gives no more than there are.
  arrival.visit->Hold(connection_places_.Take());
  ++arrivals_;
  auto begin = [this, arrival = std::move(arrival)]() mutable {
    --arrivals_;
    const auto connection = std::make_shared<PeerConnection>(
        std::move(arrival),
        PeerConnection::Surroundings{handler_, limits_, buffer_, options_, counters_, lines_});
    connections_.push_back(connection);
    connection->Start();
  };
  asio::post(io_, std::move(begin));
}

// On its own thread.
template <typename Action>
void NetThread::ForEach(Action action) {
  asio::post(io_, [this, action = std::move(action)] {
    for (const auto& weak : connections_) {
      if (const auto connection = weak.lock()) {
        action(*connection);
      }
    }
  });
}

void NetThread::ChangeSecurity(const ServerSecurity& security) {
  ForEach([security](PeerConnection& connection) { connection.ChangeSecurity(security); });
}

void NetThread::Drain() {
  ForEach([](PeerConnection& connection) { connection.Drain(); });
}

void NetThread::Probe(std::function<void()> answer) {
  asio::post(io_, std::move(answer));
}

void NetThread::Stop() {
  io_.stop();
  if (thread_.joinable()) {
    thread_.join();
  }
  for (const auto& weak : connections_) {
    if (const auto connection = weak.lock()) {
      connection->CloseNow();  // what it has queued may hold it
    }
  }
}

asio::awaitable<void> NetThread::CheckDeadlines() {
  asio::steady_timer timer(io_);
  while (true) {
    timer.expires_after(LookEvery(options_));
    co_await timer.async_wait(asio::use_awaitable);
    try {
      CheckDeadlinesOnce();
    } catch (const std::exception& error) {  // without memory, say: the next time
      spdlog::error("network thread: deadlines: {}", error.what());
    }
  }
}

void NetThread::CheckDeadlinesOnce() {
  const auto now = PeerConnection::Clock::now();
  handler_.ReturnFreed(now);
  std::erase_if(connections_, [now](const auto& weak) {
    const auto connection = weak.lock();
    if (connection) {
      connection->CheckDeadlines(now);
    }
    return connection == nullptr;
  });
}

void NetThread::Run() {
  asio::co_spawn(io_, CheckDeadlines(), asio::detached);
  while (!io_.stopped()) {
    try {
      io_.run();
    } catch (const std::exception& error) {  // of no connection: those end by themselves
      spdlog::error("network thread: {}", error.what());
    }
  }
}

}  // namespace atlas
