#include "tests/client/support/link_proxy.h"

#include <algorithm>
#include <array>
#include <optional>
#include <stdexcept>
#include <utility>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

namespace atlas {
namespace {

constexpr int kSocketBytes = 16'384;
constexpr int kBacklog = 64;

sockaddr_in Loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// A socket on that port of loopback, 0 for any, whether another one that does not listen has it or
// not.
int Bind(std::uint16_t port) {
  const int bound = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int yes = 1;
  setsockopt(bound, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  sockaddr_in address = Loopback(port);
  if (bind(bound, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0) {
    throw std::runtime_error("no loopback port to listen on");
  }
  return bound;
}

std::uint16_t PortOf(int bound) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  getsockname(bound, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

int Listen(std::uint16_t port) {
  const int listener = Bind(port);
  if (listen(listener, kBacklog) != 0) throw std::runtime_error("no loopback port to listen on");
  return listener;
}

// Little waits in the sockets, so that a slow link is felt at its ends.
int ConnectTo(const Endpoint& daemon, bool is_slow) {
  const int connected = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (is_slow) {
    setsockopt(connected, SOL_SOCKET, SO_RCVBUF, &kSocketBytes, sizeof(kSocketBytes));
  }
  sockaddr_in address = Loopback(daemon.port);
  if (connect(connected, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0) {
    fcntl(connected, F_SETFL, O_NONBLOCK);
    return connected;
  }
  close(connected);
  return -1;
}

void CloseByReset(int socket) {
  const linger now{1, 0};
  setsockopt(socket, SOL_SOCKET, SO_LINGER, &now, sizeof(now));
  close(socket);
}

int PollTime(std::chrono::steady_clock::time_point due) {
  if (due == std::chrono::steady_clock::time_point::max()) return -1;
  const auto wait =
      std::chrono::ceil<std::chrono::milliseconds>(due - std::chrono::steady_clock::now());
  return static_cast<int>(std::max<std::int64_t>(wait.count(), 0));
}

}  // namespace

class LinkProxy::Connection {
 public:
  Connection(int client, int daemon, const LinkPlan& plan)
      : client_(client),
        daemon_(daemon),
        plan_(plan),
        up_(client, daemon, plan.pace, plan.up),
        down_(daemon, client, plan.pace, plan.down) {}
  ~Connection() {
    const bool is_reset =
        is_broken() || up_.cut() == LinkCut::Kind::kReset || down_.cut() == LinkCut::Kind::kReset;
    for (const int socket : {daemon_, client_}) {
      if (is_reset) {
        CloseByReset(socket);
      } else {
        close(socket);
      }
    }
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  Connection(Connection&&) = delete;
  Connection& operator=(Connection&&) = delete;

  std::array<pollfd, 2> Events() const {
    const auto events = [](int socket, const LinkWay& from, const LinkWay& to) {
      const auto wanted = static_cast<short>(from.ReadEvents() | to.WriteEvents());
      return pollfd{wanted == 0 ? -1 : socket, wanted, 0};  // else it would tell of a hang-up
    };
    return {events(client_, up_, down_), events(daemon_, down_, up_)};
  }
  Clock::time_point due() const { return std::min(up_.due(), down_.due()); }

  void Move(Bytes& passed) {
    if (up_.ReadEvents() != 0) up_.Read();
    if (down_.ReadEvents() != 0) down_.Read();
    up_.Deliver(nullptr);
    down_.Deliver(plan_.is_recorded ? &passed : nullptr);
  }

  bool is_over() const {
    return is_broken() || up_.ends_both() || down_.ends_both() ||
           (up_.is_over() && down_.is_over());
  }
  const LinkPlan& plan() const { return plan_; }
  const LinkWay& up() const { return up_; }
  const LinkWay& down() const { return down_; }

 private:
  bool is_broken() const { return up_.is_broken() || down_.is_broken(); }

  int client_;
  int daemon_;
  LinkPlan plan_;
  LinkWay up_;
  LinkWay down_;
};

LinkProxy::LinkProxy(const Endpoint& daemon, Planner planner)
    : daemon_(daemon),
      planner_(std::move(planner)),
      port_holder_(Bind(0)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      port_(PortOf(port_holder_)) {
  listener_ = Listen(port_);
  thread_ = std::thread([this] { Run(); });
}

LinkProxy::LinkProxy(const Endpoint& daemon, const LinkPlan& plan)
    : LinkProxy(daemon, [plan] { return plan; }) {}

LinkProxy::~LinkProxy() {
  End(Ending::kNow);
  for (const int socket : {listener_, port_holder_, wake_}) {
    if (socket >= 0) close(socket);
  }
}

void LinkProxy::End(Ending ending) {
  ending_ = ending;
  eventfd_write(wake_, 1);
  if (thread_.joinable()) thread_.join();
}

const Bytes& LinkProxy::Passed() {
  End(Ending::kWithTheLast);
  return passed_;
}

LinkTotals LinkProxy::totals() const {
  return {opened_, cuts_, stalls_, refusals_, bytes_up_, bytes_down_};
}

void LinkProxy::Run() {
  while (ending_ != Ending::kNow && (ending_ == Ending::kNotYet || !connections_.empty())) {
    if (listener_ < 0 && Clock::now() >= refused_until_) listener_ = Listen(port_);
    Wait();
    Accept();
    for (const auto& connection : connections_) {
      Move(*connection);
    }
    std::erase_if(connections_, [this](const auto& connection) { return IsOver(*connection); });
  }
  connections_.clear();
}

void LinkProxy::Wait() {
  std::vector<pollfd> events = {{wake_, POLLIN, 0}, {listener_, POLLIN, 0}};
  Clock::time_point due = listener_ < 0 ? refused_until_ : Clock::time_point::max();
  for (const auto& connection : connections_) {
    for (const pollfd& event : connection->Events()) {
      events.push_back(event);
    }
    due = std::min(due, connection->due());
  }
  poll(events.data(), events.size(), PollTime(due));
}

void LinkProxy::Accept() {
  if (listener_ < 0) return;
  const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (client < 0) return;
  const LinkPlan plan = planner_();
  const int daemon = ConnectTo(daemon_, plan.pace.bits_per_s > 0.0);
  if (daemon < 0) return CloseByReset(client);
  ++opened_;
  connections_.push_back(std::make_unique<Connection>(client, daemon, plan));
}

void LinkProxy::Move(Connection& connection) {
  const std::uint64_t up = connection.up().passed_bytes();
  const std::uint64_t down = connection.down().passed_bytes();
  connection.Move(passed_);
  bytes_up_ += connection.up().passed_bytes() - up;
  bytes_down_ += connection.down().passed_bytes() - down;
}

bool LinkProxy::IsOver(const Connection& connection) {
  if (!connection.is_over()) return false;
  for (const LinkWay* way : {&connection.up(), &connection.down()}) {
    cuts_ += way->cut() ? 1U : 0U;
    stalls_ += way->stalls();
  }
  if (connection.plan().refused_after.count() > 0 && listener_ >= 0) {
    close(listener_);
    listener_ = -1;
    refused_until_ = Clock::now() + connection.plan().refused_after;
    ++refusals_;
  }
  return true;
}

}  // namespace atlas
