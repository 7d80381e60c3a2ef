// A TCP connection to a daemon that carries whole frames: blocking, every wait with a deadline. One
// thread at a time. Knows bytes, not messages.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "client/connection/endpoint.h"
#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

// TLS 1.3 to the daemon: PEM files.
struct ConnectionTls {
  std::filesystem::path ca;           // who vouches for the daemon
  std::filesystem::path certificate;  // that we show; empty: none
  std::filesystem::path key;          // of it
  std::string daemon_name;            // that its certificate must have; empty: the endpoint's host
};

class DaemonConnection {
 public:
  // kUnavailable when nobody listens there or the handshake fails, kTimeout after `timeout`.
  // kInvalidArgument names a file that is of no use.
  static Result<DaemonConnection> Open(const Endpoint& endpoint,
                                       std::chrono::milliseconds timeout,
                                       const std::optional<ConnectionTls>& tls = std::nullopt);

  DaemonConnection(const DaemonConnection&) = delete;
  DaemonConnection& operator=(const DaemonConnection&) = delete;
  DaemonConnection(DaemonConnection&&) noexcept;
  DaemonConnection& operator=(DaemonConnection&&) noexcept;
  ~DaemonConnection();

  // A whole frame, header included. After a failure the connection is closed and every further call
  // returns that failure.
  Status Send(ByteSpan frame, std::chrono::milliseconds timeout);
  // The payload of the next frame. kUnavailable when the peer closed, kTimeout when the frame was
  // not whole in time, kInvalidData when it is not a frame.
  Result<Bytes> Receive(std::chrono::milliseconds timeout);
  // The same, but nullopt when the frame was not whole in time: the connection goes on, and what
  // came of the frame is kept.
  Result<std::optional<Bytes>> Poll(std::chrono::milliseconds timeout);

  const Endpoint& endpoint() const;
  std::uint64_t bytes_sent() const;
  std::uint64_t bytes_received() const;

 private:
  class Impl;
  explicit DaemonConnection(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace atlas
