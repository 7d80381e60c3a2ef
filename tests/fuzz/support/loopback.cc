#include "tests/fuzz/support/loopback.h"

#include <array>
#include <cerrno>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

constexpr timeval kPatience{8, 0};  // less than a fuzzer gives an input

sockaddr_in AddressOf(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

void Prepare(int fd) {
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  ::setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
}

}  // namespace

LoopbackSocket LoopbackSocket::Connect(std::uint16_t port) {
  const sockaddr_in address = AddressOf(port);
  while (true) {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    Prepare(fd);
    if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      return LoopbackSocket(fd);
    }
    const bool is_interrupted = errno == EINTR;  // by a fuzzer's clock
    ::close(fd);
    Require(is_interrupted, "there is somebody to connect to");
  }
}

LoopbackSocket::~LoopbackSocket() {
  ::close(fd_);
}

bool LoopbackSocket::Send(ByteSpan bytes) const {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) {
      continue;
    }
    Require(sent >= 0 || errno != EAGAIN, "the other end reads");
    if (sent <= 0) {
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

void LoopbackSocket::CloseSending() const {
  ::shutdown(fd_, SHUT_WR);
}

Bytes LoopbackSocket::Receive() const {
  Bytes room(64u << 10);
  ssize_t size = -1;
  do {
    size = ::recv(fd_, room.data(), room.size(), 0);
  } while (size < 0 && errno == EINTR);
  Require(size >= 0 || errno != EAGAIN, "the other end answers or closes");
  room.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return room;
}

ReciteServer::ReciteServer() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = AddressOf(0);
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof address;
  Require(::bind(listener_, generic, size) == 0 && ::listen(listener_, 4) == 0 &&
              ::getsockname(listener_, generic, &size) == 0,
          "there is a port of loopback");
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this] { Serve(); });
}

ReciteServer::~ReciteServer() {
  ::shutdown(listener_, SHUT_RDWR);
  thread_.join();
  ::close(listener_);
}

void ReciteServer::SetText(ByteSpan text) {
  const std::lock_guard lock(mutex_);
  text_.assign(text.begin(), text.end());
}

void ReciteServer::Serve() {
  while (true) {
    const int fd = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (fd < 0 && errno == EINTR) {
      continue;
    }
    if (fd < 0) {
      return;
    }
    Prepare(fd);
    const LoopbackSocket client(fd);
    client.Receive();
    Bytes text;
    {
      const std::lock_guard lock(mutex_);
      text = text_;
    }
    client.Send(text);
    client.CloseSending();
    while (!client.Receive().empty()) {
    }
  }
}

}  // namespace atlas::fuzz
