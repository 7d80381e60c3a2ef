// A link that delays, breaks and stalls: connections passed on to a daemon, each as its plan says,
// by one thread. While it refuses, nobody listens on its port.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "client/connection/endpoint.h"
#include "core/base/bytes.h"
#include "tests/client/support/link_way.h"

namespace atlas {

struct LinkPlan {
  LinkPace pace = {};
  LinkCut up = {};    // to the daemon
  LinkCut down = {};  // from it
  // How long further connections are refused once this one is over.
  std::chrono::milliseconds refused_after{0};
  bool is_recorded = false;  // what comes down
};

struct LinkTotals {
  std::uint64_t connections = 0;
  std::uint64_t cuts = 0;      // closed, reset or half closed
  std::uint64_t stalls = 0;    // of connections that are over, as are cuts
  std::uint64_t refusals = 0;  // times at which nobody listened
  std::uint64_t bytes_up = 0;
  std::uint64_t bytes_down = 0;
};

class LinkProxy {
 public:
  // Called by the proxy's thread for each connection, in the order in which they come.
  using Planner = std::function<LinkPlan()>;

  // Throws where there is no port to listen on.
  LinkProxy(const Endpoint& daemon, Planner planner);
  LinkProxy(const Endpoint& daemon, const LinkPlan& plan);  // the same for all
  ~LinkProxy();
  LinkProxy(const LinkProxy&) = delete;
  LinkProxy& operator=(const LinkProxy&) = delete;
  LinkProxy(LinkProxy&&) = delete;
  LinkProxy& operator=(LinkProxy&&) = delete;

  Endpoint endpoint() const { return {"127.0.0.1", port_}; }
  LinkTotals totals() const;
  // All that came down on recorded connections, once those that there are have ended: close the
  // clients before. No other is accepted then.
  const Bytes& Passed();

 private:
  class Connection;
  using Clock = std::chrono::steady_clock;

  enum class Ending { kNotYet, kWithTheLast, kNow };

  void Run();
  void Wait();
  void Accept();
  void Move(Connection& connection);
  // And counted then.
  bool IsOver(const Connection& connection);
  void End(Ending ending);

  Endpoint daemon_;
  Planner planner_;
  int port_holder_ = -1;  // bound and not listening: the port stays ours while it refuses
  int listener_ = -1;     // -1: refusing
  int wake_ = -1;
  std::uint16_t port_ = 0;
  Bytes passed_;  // the thread's until it ended, as is the rest
  std::vector<std::unique_ptr<Connection>> connections_;
  Clock::time_point refused_until_ = Clock::time_point::min();
  std::atomic<Ending> ending_{Ending::kNotYet};
  std::atomic<std::uint64_t> opened_{0};
  std::atomic<std::uint64_t> cuts_{0};
  std::atomic<std::uint64_t> stalls_{0};
  std::atomic<std::uint64_t> refusals_{0};
  std::atomic<std::uint64_t> bytes_up_{0};
  std::atomic<std::uint64_t> bytes_down_{0};
  std::thread thread_;
};

}  // namespace atlas
