// One attempt to reach a daemon: from its name to the end of the handshake, within one deadline. It
// may take several calls: what is not finished when a call ends goes on in the next one, so that a
// call's deadline may be shorter than what the link needs. Between calls nothing is done but what
// the system does by itself. One thread at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "client/connection/atlas_client.h"
#include "client/connection/daemon_connection.h"
#include "core/base/status.h"

namespace atlas {

class RpcChannel;

// Where an attempt stands: connected, failed, or neither yet.
struct ConnectProgress {
  std::optional<AtlasClient> client;
  Status failure;
  std::chrono::milliseconds retry_after{0};  // that a daemon which refused asked for
  // The daemon said that it will refuse this again (another profile or protocol), or a file of ours
  // is of no use. Bytes that make no sense say nothing of the kind.
  bool is_final = false;
};

class ConnectAttempt {
 public:
  // Its deadline is the options' connect_timeout from now.
  explicit ConnectAttempt(const ConnectionOptions& options);
  ConnectAttempt(const ConnectAttempt&) = delete;
  ConnectAttempt& operator=(const ConnectAttempt&) = delete;
  ConnectAttempt(ConnectAttempt&&) noexcept;
  ConnectAttempt& operator=(ConnectAttempt&&) noexcept;
  ~ConnectAttempt();

  // Goes on for `time` at most; not again once it is connected or failed.
  ConnectProgress Continue(std::chrono::milliseconds time);

 private:
  using Clock = std::chrono::steady_clock;

  // True when there is a channel on which the Hello was sent.
  Result<bool> Open(Clock::time_point latest);
  Result<std::optional<AtlasClient>> ShakeHands(Clock::time_point latest);
  ConnectProgress Fail(const Status& status) const;

  ConnectionOptions options_;
  Clock::time_point deadline_;
  std::optional<DaemonConnection> connection_;  // until it is open
  std::unique_ptr<RpcChannel> channel_;         // from then on
  std::uint64_t hello_ = 0;                     // the request
  std::chrono::milliseconds extra_{0};          // its reply may take, more than others or less
};

}  // namespace atlas
