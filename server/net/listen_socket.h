// A port of this machine that is ours, taken before the atlas is opened: a daemon that finds its
// port taken leaves no trace.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "core/base/status.h"

namespace atlas {

class ListenSocket {
 public:
  // Port 0 takes a free one. kInvalidArgument for what is no IP address, kUnavailable when the port
  // is taken.
  static Result<ListenSocket> Open(const std::string& host, std::uint16_t port);

  ListenSocket(const ListenSocket&) = delete;
  ListenSocket& operator=(const ListenSocket&) = delete;
  ListenSocket(ListenSocket&& other) noexcept
      : address_(std::move(other.address_)),
        port_(other.port_),
        is_ip6_(other.is_ip6_),
        descriptor_(std::exchange(other.descriptor_, -1)) {}
  ListenSocket& operator=(ListenSocket&&) = delete;
  ~ListenSocket();

  const std::string& address() const { return address_; }  // "HOST:PORT", as bound
  std::uint16_t port() const { return port_; }
  bool is_ip6() const { return is_ip6_; }
  // It is the caller's to close from now on.
  int Release() { return std::exchange(descriptor_, -1); }

 private:
  ListenSocket() = default;

  std::string address_;
  std::uint16_t port_ = 0;
  bool is_ip6_ = false;
  int descriptor_ = -1;
};

}  // namespace atlas
