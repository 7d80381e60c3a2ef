#include "tests/client/end_to_end/cut_proxy.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace atlas {
namespace {

sockaddr_in Loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

// False when the giving side closed or the taking one is gone.
bool PassOn(int from, int to) {
  std::array<std::uint8_t, 4096> chunk{};
  const ssize_t size = recv(from, chunk.data(), chunk.size(), 0);
  return size > 0 && send(to, chunk.data(), static_cast<std::size_t>(size), MSG_NOSIGNAL) == size;
}

// What the client sends next is answered by a reset, and it is told at once.
void Reset(int socket) {
  const linger now{1, 0};
  setsockopt(socket, SOL_SOCKET, SO_LINGER, &now, sizeof(now));
}

}  // namespace

CutProxy::CutProxy(const Endpoint& daemon, std::int64_t bytes_until_cut, Cut cut)
    : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = Loopback(0);
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof(address);
  if (bind(listener_, generic, size) != 0 || listen(listener_, 1) != 0 ||
      getsockname(listener_, generic, &size) != 0) {
    throw std::runtime_error("no loopback port to listen on");
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::thread(
      [this, port = daemon.port, bytes_until_cut, cut] { Run(port, bytes_until_cut, cut); });
}

CutProxy::~CutProxy() {
  shutdown(listener_, SHUT_RDWR);
  if (thread_.joinable()) thread_.join();
  close(listener_);
}

const Bytes& CutProxy::Passed() {
  if (thread_.joinable()) thread_.join();
  return passed_;
}

bool CutProxy::PassBack(int from, int to, std::int64_t& bytes_left) {
  std::array<std::uint8_t, 4096> chunk{};
  const auto most = std::min<std::int64_t>(bytes_left, std::int64_t{chunk.size()});
  const ssize_t size = recv(from, chunk.data(), static_cast<std::size_t>(most), 0);
  if (size <= 0) return false;
  passed_.insert(passed_.end(), chunk.begin(), chunk.begin() + size);
  bytes_left -= size;
  return send(to, chunk.data(), static_cast<std::size_t>(size), MSG_NOSIGNAL) == size;
}

void CutProxy::Run(std::uint16_t daemon_port, std::int64_t bytes_left, Cut cut) {
  const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  const int daemon = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = Loopback(daemon_port);
  bool is_open = connect(daemon, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  while (is_open && bytes_left > 0) {
    std::array<pollfd, 2> ends{pollfd{client, POLLIN, 0}, pollfd{daemon, POLLIN, 0}};
    is_open = poll(ends.data(), ends.size(), -1) > 0;
    if (is_open && ends[0].revents != 0) is_open = PassOn(client, daemon);
    if (is_open && ends[1].revents != 0) is_open = PassBack(daemon, client, bytes_left);
  }
  if (cut == Cut::kReset) Reset(client);
  close(daemon);
  close(client);
}

}  // namespace atlas
