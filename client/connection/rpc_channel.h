// Requests and replies over a connection. Internal to the client library: this header has Protobuf
// in it and is included by sources only.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "client/connection/daemon_connection.h"
#include "core/base/status.h"
#include "proto/wire/envelope.h"

namespace atlas {

// As the field timeout_ms of a request says it.
inline std::uint32_t TimeoutField(std::chrono::milliseconds timeout) {
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(timeout.count(), 0, INT64_C(0xFFFFFFFF)));
}

class RpcChannel {
 public:
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::milliseconds;

  // `frame_timeout`: for every frame to be sent or to arrive whole. `max_retry_after`: the most
  // that is believed of a daemon that wants to be left alone.
  RpcChannel(DaemonConnection connection, Milliseconds frame_timeout, Milliseconds max_retry_after);

  // What answers a request that nobody waits for: called whatever the channel reads for. A failure
  // of it breaks the connection.
  using Listener = std::function<Status(const wire::Envelope&)>;

  // Whether a request could be sent at once: false when an earlier one is still on its way at
  // `latest`.
  Result<bool> IsFree(Clock::time_point latest);
  // Gives the request the next id, which is returned. With a `latest`: what is not sent then goes
  // out in later calls; kUnavailable when an earlier one is still on its way then.
  Result<std::uint64_t> Send(wire::Envelope& request,
                             Clock::time_point latest = Clock::time_point::max());
  // From now on, until it is forgotten, what answers the request goes to the listener. Somebody may
  // wait for an answer, and for no event.
  enum class Kind : std::uint8_t { kAnswer, kEvent };
  void Listen(std::uint64_t id, Kind kind, Listener listener) {
    listeners_[id] = {kind, std::move(listener)};
  }
  void Forget(std::uint64_t id) { listeners_.erase(id); }
  // Forgets a watch and has the daemon told so, now or with the next request. Does not wait.
  void Cancel(std::uint64_t id);
  // Reads until a listener was told something; false when none was at `latest`, which may be never
  // where an answer is due: kTimeout when that takes longer than usual, over all these calls.
  Result<bool> Hear(Clock::time_point latest, Kind due);
  // The next reply to request `id`: replies to earlier requests, which were given up, are skipped.
  // An Error reply becomes its status; another body than `expected` or `also` is kInvalidData. A
  // refusal of the connection as a whole (an Error of no request) is a failure here.
  Result<wire::Envelope> ReceiveFor(std::uint64_t id,
                                    wire::Envelope::BodyCase expected,
                                    wire::Envelope::BodyCase also,
                                    Milliseconds extra = Milliseconds(0));
  // The next reply to request `id`, whatever its body; else as above.
  Result<wire::Envelope> ReceiveAnyFor(std::uint64_t id, Milliseconds extra = Milliseconds(0));
  // The same, but nullopt when no reply was whole at `latest`: the next call goes on with it.
  // kTimeout when a frame takes longer than usual over all these calls.
  Result<std::optional<wire::Envelope>> PollFor(std::uint64_t id,
                                                Milliseconds extra,
                                                Clock::time_point latest);
  // Send and ReceiveFor with one body expected.
  Result<wire::Envelope> Call(wire::Envelope& request,
                              wire::Envelope::BodyCase expected,
                              Milliseconds extra = Milliseconds(0));

  // The reply is one that no caller expects: breaks the connection.
  Status Unexpected(const wire::Envelope& reply);
  // The daemon does not keep to the protocol: nothing that comes is worth anything. Returns `why`.
  Status Break(Status why);
  // By a failure of the link, by Break, or by an Error of no request. A refused request breaks
  // nothing.
  bool is_broken() const { return is_broken_ || connection_.is_closed(); }
  // The last request that was sent, or 0 when something that answered it was thrown away.
  std::uint64_t last_call() const { return last_call_; }
  // Whether the last frame that came was an Error to this request.
  bool has_refused(std::uint64_t id) const { return refused_id_ == id; }
  // A daemon that refused this does not want to be asked again for a while. What it refused an
  // upload for may be a limit of that vehicle: nothing else has to wait for it.
  enum class Refused : std::uint8_t { kUpload, kOther };
  void NoteRetryAfter(const wire::Error& error, Refused refused);
  // How long the daemon still wants to be left alone, by all that was noted, and by what is not
  // about uploads; 0: it does not.
  Milliseconds retry_after() const;
  Milliseconds retry_after_of_reads() const;
  // Of the frame received last, its header included.
  std::uint64_t last_frame_bytes() const { return last_frame_bytes_; }
  DaemonConnection& connection() { return connection_; }

 private:
  struct Listening {
    Kind kind = Kind::kAnswer;
    Listener tell;
  };

  Result<Bytes> NextFrame(wire::Envelope& request);
  // Of all that was cancelled, one behind the other.
  Result<Bytes> CancelFrames();
  Result<wire::Envelope> Read(ByteSpan payload);
  Status CheckPatience(Clock::time_point began, Milliseconds extra);
  // True: it had a listener.
  Result<bool> Tell(const wire::Envelope& reply);
  // nullopt: told to a listener, or an answer to an earlier request.
  Result<std::optional<wire::Envelope>> AnswerTo(std::uint64_t id, wire::Envelope reply);

  DaemonConnection connection_;
  Milliseconds frame_timeout_;
  Milliseconds max_retry_after_;
  Clock::time_point retry_upload_at_ = Clock::time_point::min();
  Clock::time_point retry_at_ = Clock::time_point::min();  // anything
  Clock::time_point waiting_since_ = Clock::now();         // for a frame that answers
  Clock::time_point sending_since_ = Clock::now();         // the last request
  std::uint64_t last_id_ = 0;                              // that was given
  std::uint64_t last_call_ = 0;
  std::vector<std::uint64_t> cancelled_;  // that the daemon was not told yet
  std::map<std::uint64_t, Listening> listeners_;
  bool is_broken_ = false;
  std::optional<std::uint64_t> refused_id_;  // by the last frame
  std::uint64_t last_frame_bytes_ = 0;
};

}  // namespace atlas
