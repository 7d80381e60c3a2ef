// One of the threads that run connections. A connection stays on the thread that it began on, so
// that nothing of it is shared but what is behind RequestHandler.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "server/net/connection/peer_connection.h"
#include "server/net/net_counters.h"
#include "server/net/net_options.h"
#include "server/net/places.h"
#include "server/net/requests/request_handler.h"
#include "server/net/server_security.h"

namespace atlas {

class NetThread {
 public:
  // All outlive this. Runs from the start.
  NetThread(RequestHandler& handler, SharedLimits& limits, const NetOptions& options);
  NetThread(const NetThread&) = delete;
  NetThread& operator=(const NetThread&) = delete;
  ~NetThread() { Stop(); }

  // For the sockets of its connections.
  boost::asio::io_context& io() { return io_; }
  std::size_t connections() const { return connection_places_.taken(); }
  // That Serve() was called for and that have not begun.
  std::size_t arrivals() const { return arrivals_.load(); }
  const NetCounters& counters() const { return counters_; }

  // From any thread: begins a connection.
  void Serve(PeerConnection::Arrival arrival);
  // From any thread: these rules hold from now on, for those who are there, too.
  void ChangeSecurity(const ServerSecurity& security);
  // From any thread: connections end when they have answered what they have read.
  void Drain();
  // From any thread: calls `answer` on this one.
  void Probe(std::function<void()> answer);
  // Connections that are left are cut.
  void Stop();

 private:
  template <typename Action>
  void ForEach(Action action);
  boost::asio::awaitable<void> CheckDeadlines();
  void CheckDeadlinesOnce();
  void Run();

  RequestHandler& handler_;
  SharedLimits& limits_;
  const NetOptions& options_;
  std::vector<std::uint8_t> buffer_;
  NetCounters counters_;
  PeerLines lines_;
  Places connection_places_;
  std::atomic<std::size_t> arrivals_ = 0;
  boost::asio::io_context io_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  std::vector<std::weak_ptr<PeerConnection>> connections_;
  std::thread thread_;
};

}  // namespace atlas
