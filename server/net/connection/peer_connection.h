// One peer: reads its frames, lets its requests run side by side, keeps it within its limits. Lives
// on its network thread; owned by its own coroutines.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "proto/wire/envelope.h"
#include "proto/wire/frame.h"
#include "server/net/connection/frame_clock.h"
#include "server/net/connection/held_bytes.h"
#include "server/net/connection/peer_access.h"
#include "server/net/connection/shared_limits.h"
#include "server/net/connection/visit.h"
#include "server/net/net_options.h"
#include "server/net/peer_record.h"
#include "server/net/requests/request_handler.h"
#include "server/net/server_security.h"
#include "server/net/stream/peer_stream.h"
#include "server/net/stream/reply_writer.h"

namespace atlas {

class PeerConnection : public std::enable_shared_from_this<PeerConnection> {
 public:
  using Clock = std::chrono::steady_clock;

  // All outlive this; `buffer` is its thread's, to read into: what is in there is handled before
  // anybody else runs.
  struct Surroundings {
    RequestHandler& handler;
    SharedLimits& limits;
    std::span<std::uint8_t> buffer;
    const NetOptions& options;
    NetCounters& counters;  // of its thread, as is the next
    PeerLines& lines;
  };

  // A socket that was accepted, and what it may do.
  struct Arrival {
    boost::asio::ip::tcp::socket socket;
    std::shared_ptr<Visit> visit;
    SslSession session;  // null: in the clear
    ServerSecurity security;
  };

  PeerConnection(Arrival arrival, const Surroundings& surroundings);
  PeerConnection(const PeerConnection&) = delete;
  PeerConnection& operator=(const PeerConnection&) = delete;
  ~PeerConnection() = default;

  // Spawns the coroutines; they keep the connection alive until the peer or Drain() ends it.
  void Start();
  // Takes no further request; closes when those in flight are answered.
  void Drain();
  void CloseNow();
  // To be called now and then: closes when the peer owes something for too long, or may not come in
  // any more: certificates and tokens expire.
  void CheckDeadlines(Clock::time_point now);
  // From now on these rules hold: closes when the peer may not come in any more.
  void ChangeSecurity(const ServerSecurity& security);

  const PeerRecord& peer() const { return peer_; }

 private:
  enum class Phase {
    kOpen,
    kLingering,  // everything was sent; what still comes is dropped
    kClosed,
  };

  // What is left to be awaited of the reply.
  using MaybeAwaited = std::optional<boost::asio::awaitable<void>>;

  boost::asio::awaitable<void> Read();
  boost::asio::awaitable<void> Write();
  boost::asio::awaitable<void> Serve(boost::asio::awaitable<void> request);
  // Requests until the peer closes, breaks a rule (the error) or the connection drains.
  boost::asio::awaitable<Status> ReadRequests();
  // The requests of which all bytes have come.
  boost::asio::awaitable<Status> TakeRequests();
  Status TakeRequest(ByteSpan payload);
  boost::asio::awaitable<Status> TakeLargeRequest(LargeFrame frame);
  void Begin(MaybeAwaited rest);
  MaybeAwaited Greet(wire::Envelope hello);
  MaybeAwaited Answer(Request request, const Status& denied);
  bool HasRoom() const;
  boost::asio::awaitable<void> WaitForRoom();
  // Reads on and drops what comes: closing a socket with unread bytes resets it, and the peer would
  // lose the replies that are still under way.
  boost::asio::awaitable<void> Linger();
  // Closes when it would not come in any more.
  void CheckIdentity();
  // Whom it is, within what one may have.
  Status ComeIn(const wire::Envelope& hello);
  // What has come of a frame, or waits for being read, counts among the large ones when it is.
  Status CountPart(std::size_t bytes, Clock::time_point deadline);
  // Others need the room of what has come of its frame.
  void MakeRoom();
  // Takes nothing any more; what was answered goes out first.
  void Refuse(const Status& why);
  // That the peer owes; null: nothing.
  std::optional<Lateness> WhatIsLate(Clock::time_point now);
  // As long as its name has sent too much.
  boost::asio::awaitable<void> KeepToRate(std::size_t bytes);
  // What a request that was read counts for, until it is destroyed.
  std::shared_ptr<const void> HoldRequest(std::size_t bytes);
  void DropUnread();
  void Finish();

  PeerStream stream_;
  RequestHandler& handler_;
  SharedLimits& limits_;
  const std::span<std::uint8_t> buffer_;
  const NetOptions& options_;
  PeerRecord peer_;
  ReplyWriter writer_;
  Peer as_peer_;  // for its requests
  FrameDecoder decoder_;
  // A large frame that is read where it came in all the same.
  const std::function<bool(ByteSpan payload)> is_copied_ = [this](ByteSpan payload) {
    return payload.size() <= options_.copied_frame_bytes &&
           IsSmallBesidesBlobs(payload, options_.large_frame_bytes);
  };
  HeldBytes held_;  // received and not answered yet
  boost::asio::cancellation_signal stop_reading_;
  boost::asio::steady_timer changed_;  // cancelled when a request is done
  FrameClock frame_clock_;             // of what the peer owes next
  Clock::time_point linger_until_;
  PeerAccess access_;
  boost::asio::steady_timer rate_pause_;
  std::size_t unpaid_requests_ = 0;  // that came since the last pause
  std::size_t requests_ = 0;
  std::size_t request_bytes_ = 0;
  Phase phase_ = Phase::kOpen;
  bool is_greeted_ = false;
  bool is_held_up_ = false;  // by its own requests and replies: it is not read from
  bool is_refused_ = false;
  bool is_draining_ = false;
  bool is_reading_ = true;
};

}  // namespace atlas
