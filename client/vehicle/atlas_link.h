// Keeps a connection to one daemon: an attempt goes on over as many calls as it needs within its
// own deadline, and after a failure the next comes not before a random part of a delay that
// doubles, so that a fleet does not come back all at once, nor before the daemon wants it. Stops by
// itself when what failed will fail again. One thread at a time.
#pragma once

#include <chrono>
#include <functional>
#include <optional>

#include "client/connection/atlas_client.h"
#include "client/connection/connect_attempt.h"
#include "core/base/status.h"

namespace atlas {

struct LinkOptions {
  ConnectionOptions connection;
  std::chrono::milliseconds first_delay{500};  // the most before the second attempt
  std::chrono::milliseconds max_delay{60'000};
  // The most, and half of it the least, before an attempt after a refusal that takes people to undo
  // (kPermissionDenied: a certificate or a token that counts for nothing yet).
  std::chrono::milliseconds denied_delay{60'000};
  // The atlas that this vehicle holds: a daemon with another one is refused. Empty: any, and the
  // first one's from then on.
  Bytes atlas_id = {};
};

// What the link takes from the world.
struct LinkEnvironment {
  using Clock = std::chrono::steady_clock;

  std::function<Clock::time_point()> now;
  std::function<void(std::chrono::milliseconds)> sleep;
  std::function<double()> random;  // uniform in [0, 1)
  // Begins an attempt; what it returns is its Continue (ConnectAttempt).
  using Attempt = std::function<ConnectProgress(std::chrono::milliseconds)>;
  std::function<Attempt(const ConnectionOptions&)> connect;

  static LinkEnvironment Real();
};

class AtlasLink {
 public:
  explicit AtlasLink(LinkOptions options, LinkEnvironment environment = LinkEnvironment::Real());

  // The connection, made if there is none and an attempt is due, for `timeout` at most. Does not
  // sleep. kUnavailable: the next attempt is not due, or it is not finished and goes on in the next
  // call. Valid until the next call of the link.
  Result<AtlasClient*> Client(std::chrono::milliseconds timeout);
  // The same, sleeping between attempts. The last failure after `timeout`.
  Result<AtlasClient*> Wait(std::chrono::milliseconds timeout);
  // What a call of the client came to: when that broke the connection (AtlasClient::is_broken) it
  // is dropped. What the daemon refused, or did not finish in the time that it was given, breaks
  // none.
  void Report(const Status& status);

  bool is_connected() const { return client_.has_value(); }
  // Ok, or why no attempt is made any more.
  const Status& refusal() const { return refusal_; }
  // Of the latest attempt, or connection, that failed; ok: none did.
  const Status& last_failure() const { return last_failure_; }
  // Somebody changed what was refused: attempts go on at once.
  void TryAgain();

 private:
  using Clock = LinkEnvironment::Clock;

  // Ok: connected, or the attempt goes on.
  Status Continue(std::chrono::milliseconds timeout);
  Status CheckAtlas(const AtlasClient& client);
  void NoteFailure(const Status& status, std::chrono::milliseconds retry_after);
  std::chrono::milliseconds NextDelay(StatusCode code);

  LinkOptions options_;
  LinkEnvironment environment_;
  LinkEnvironment::Attempt attempt_;  // under way, or none
  std::optional<AtlasClient> client_;
  Status refusal_;
  Status last_failure_;
  int failures_ = 0;  // since the last success
  Clock::time_point next_attempt_ = Clock::time_point::min();
};

}  // namespace atlas
