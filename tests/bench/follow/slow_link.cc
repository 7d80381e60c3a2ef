#include "tests/bench/follow/slow_link.h"

#include <algorithm>
#include <array>
#include <deque>
#include <stdexcept>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kPacketBytes = 1'400;
constexpr std::size_t kQueuedPackets = 16;  // what waits in the network; the rest waits in sockets
constexpr int kSocketBytes = 16'384;

sockaddr_in Loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// One way of a connection.
class OneWay {
 public:
  OneWay(int from, int to, const SlowLinkOptions& options, Clock::time_point opened)
      : from_(from), to_(to), options_(options), free_at_(opened) {}

  pollfd ToPoll() const { return {may_read() ? from_ : -1, POLLIN, 0}; }
  bool is_over() const { return is_closed_ && packets_.empty(); }
  Clock::time_point due() const {
    return packets_.empty() ? Clock::time_point::max() : packets_.front().due;
  }

  void Read() {
    std::array<std::uint8_t, kPacketBytes> bytes{};
    const ssize_t size = recv(from_, bytes.data(), bytes.size(), 0);
    if (size <= 0) {
      is_closed_ = true;
      return;
    }
    const std::chrono::duration<double> takes(8.0 * static_cast<double>(size) /
                                              options_.bits_per_s);
    free_at_ =
        std::max(free_at_, Clock::now()) + std::chrono::duration_cast<Clock::duration>(takes);
    packets_.push_back({free_at_ + options_.latency, {bytes.begin(), bytes.begin() + size}});
  }

  // What has arrived by now: bytes passed on.
  std::size_t Deliver() {
    std::size_t delivered = 0;
    while (due() <= Clock::now()) {
      const auto& bytes = packets_.front().bytes;
      const bool is_taken =
          send(to_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
      is_closed_ = is_closed_ || !is_taken;
      delivered += bytes.size();
      packets_.pop_front();
    }
    return delivered;
  }

 private:
  struct Packet {
    Clock::time_point due;
    std::vector<std::uint8_t> bytes;
  };

  bool may_read() const { return !is_closed_ && packets_.size() < kQueuedPackets; }

  int from_;
  int to_;
  SlowLinkOptions options_;
  Clock::time_point free_at_;  // when all that was read has left
  std::deque<Packet> packets_;
  bool is_closed_ = false;
};

int PollTime(Clock::time_point due) {
  if (due == Clock::time_point::max()) return 1'000;
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(due - Clock::now());
  return static_cast<int>(std::max<std::int64_t>(wait.count(), 0));
}

}  // namespace

SlowLink::SlowLink(const Endpoint& daemon, const SlowLinkOptions& options)
    : options_(options), listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = Loopback(0);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof(address);
  if (bind(listener_, generic, size) != 0 || listen(listener_, 1) != 0 ||
      getsockname(listener_, generic, &size) != 0) {
    throw std::runtime_error("no loopback port to listen on");
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this, port = daemon.port] { Run(port); });
}

SlowLink::~SlowLink() {
  shutdown(listener_, SHUT_RDWR);
  thread_.join();
  close(listener_);
}

void SlowLink::Run(std::uint16_t daemon_port) {
  const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  const int daemon = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  setsockopt(daemon, SOL_SOCKET, SO_RCVBUF, &kSocketBytes, sizeof(kSocketBytes));
  sockaddr_in address = Loopback(daemon_port);
  const auto opened = Clock::now() + 2 * options_.latency;
  OneWay up(client, daemon, options_, opened);
  OneWay down(daemon, client, options_, opened);
  bool is_open = connect(daemon, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  while (is_open) {
    std::array<pollfd, 2> ends{up.ToPoll(), down.ToPoll()};
    poll(ends.data(), ends.size(), PollTime(std::min(up.due(), down.due())));
    if (ends[0].revents != 0) up.Read();
    if (ends[1].revents != 0) down.Read();
    up.Deliver();
    bytes_down_ += down.Deliver();
    is_open = !up.is_over() && !down.is_over();
  }
  close(daemon);
  close(client);
}

}  // namespace atlas::testing
