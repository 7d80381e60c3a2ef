// Requests and replies over a connection. Internal to the client library: this header has Protobuf
// in it and is included by sources only.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "client/connection/daemon_connection.h"
#include "core/base/status.h"
#include "proto/wire/envelope.h"

namespace atlas {

class RpcChannel {
 public:
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::milliseconds;

  // `frame_timeout`: for every frame to be sent or to arrive whole. `max_retry_after`: the most
  // that is believed of a daemon that wants to be left alone.
  RpcChannel(DaemonConnection connection, Milliseconds frame_timeout, Milliseconds max_retry_after);

  // Gives the request the next id, which is returned. kTimeout when it is not sent at `latest`.
  Result<std::uint64_t> Send(wire::Envelope& request,
                             Clock::time_point latest = Clock::time_point::max());
  // The next reply, whatever it answers, `extra` longer than usual. A refusal of the connection as
  // a whole (an Error of no request) is a failure here.
  Result<wire::Envelope> Receive(Milliseconds extra = Milliseconds(0));
  // The next reply to request `id`: replies to earlier requests, which were given up, are skipped.
  // An Error reply becomes its status; another body than `expected` or `also` is kInvalidData.
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

  // The reply is one that no caller expects.
  Status Unexpected(const wire::Envelope& reply) const;
  std::uint64_t last_id() const { return last_id_; }
  // Whether the last frame that came was an Error to this request.
  bool has_refused(std::uint64_t id) const { return refused_id_ == id; }
  // How long the daemon still wants to be left alone, by what it refused so far; 0: it does not.
  Milliseconds retry_after() const;
  // Of the frame received last, its header included.
  std::uint64_t last_frame_bytes() const { return last_frame_bytes_; }
  DaemonConnection& connection() { return connection_; }

 private:
  Result<wire::Envelope> Read(ByteSpan payload);
  // nullopt: an answer to an earlier request.
  Result<std::optional<wire::Envelope>> AnswerTo(std::uint64_t id, wire::Envelope reply) const;
  void NoteRetryAfter(const wire::Error& error);

  DaemonConnection connection_;
  Milliseconds frame_timeout_;
  Milliseconds max_retry_after_;
  Clock::time_point retry_at_ = Clock::time_point::min();
  Clock::time_point waiting_since_ = Clock::now();  // for a frame
  std::uint64_t last_id_ = 0;
  std::optional<std::uint64_t> refused_id_;  // by the last frame
  std::uint64_t last_frame_bytes_ = 0;
};

}  // namespace atlas
