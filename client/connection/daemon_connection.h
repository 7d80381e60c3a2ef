// A TCP connection to a daemon that carries whole frames: blocking, every wait with a deadline. It
// is made in steps, so that a slow one may outlive the call that began it. One thread at a time.
// Knows bytes, not messages.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "client/connection/endpoint.h"
#include "client/connection/name_lookup.h"
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
  using Clock = std::chrono::steady_clock;

  // Not connected yet. `names` is asked for the endpoint's host. Without TLS it connects to
  // loopback only, unless plaintext is allowed.
  DaemonConnection(const Endpoint& endpoint,
                   const std::optional<ConnectionTls>& tls,
                   bool allow_plaintext,
                   std::shared_ptr<NameLookup> names);

  DaemonConnection(const DaemonConnection&) = delete;
  DaemonConnection& operator=(const DaemonConnection&) = delete;
  DaemonConnection(DaemonConnection&&) noexcept;
  DaemonConnection& operator=(DaemonConnection&&) noexcept;
  ~DaemonConnection();

  // Looks the host up, connects and encrypts: true when all that is done. False when it is not done
  // at `latest`: the next call goes on with it. kUnavailable when nobody listens there or the
  // handshake fails, kTimeout when it is not done at `deadline`. kInvalidArgument names a file that
  // is of no use, or an address that nothing is sent to in the clear.
  Result<bool> Open(Clock::time_point latest, Clock::time_point deadline);
  // True when all that was taken is sent. What is not sent at `latest` goes on in later calls, also
  // in those that read. kTimeout when it is not sent at `deadline`. After a failure the connection
  // is closed and every further call returns that failure.
  Result<bool> Flush(Clock::time_point latest, Clock::time_point deadline);
  // Takes a whole frame, header included, once what was taken before is sent, and begins to send
  // it.
  Status Take(Bytes frame);
  // The payload of the next frame. kUnavailable when the peer closed, kTimeout when the frame was
  // not whole in time, kInvalidData when it is not a frame.
  Result<Bytes> Receive(std::chrono::milliseconds timeout);
  // The same, but nullopt when the frame was not whole in time: the connection goes on, and what
  // came of the frame is kept.
  Result<std::optional<Bytes>> Poll(std::chrono::milliseconds timeout);

  // By a failure.
  bool is_closed() const;
  const Endpoint& endpoint() const;
  std::uint64_t bytes_sent() const;  // of the frames that were taken
  std::uint64_t bytes_received() const;

 private:
  class Impl;

  std::unique_ptr<Impl> impl_;
};

}  // namespace atlas
