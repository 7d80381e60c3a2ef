// One peer: reads its frames, lets its requests run side by side, keeps it within its limits. Lives
// on the network thread; owned by its own coroutines.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "proto/wire/frame.h"
#include "server/net/byte_budget.h"
#include "server/net/net_options.h"
#include "server/net/reply_writer.h"
#include "server/net/request_handler.h"

namespace atlas {

class PeerConnection : public std::enable_shared_from_this<PeerConnection> {
 public:
  // `handler`, `budget` and `options` outlive this.
  PeerConnection(boost::asio::ip::tcp::socket socket,
                 RequestHandler& handler,
                 ByteBudget& budget,
                 const NetOptions& options);
  PeerConnection(const PeerConnection&) = delete;
  PeerConnection& operator=(const PeerConnection&) = delete;
  ~PeerConnection() { budget_.GiveBack(held_bytes_); }

  // Spawns the coroutines; they keep the connection alive until the peer or Drain() ends it.
  void Start();
  // Takes no further request; closes when those in flight are answered.
  void Drain();
  void CloseNow() { writer_.CloseNow(); }

  const std::string& peer() const { return peer_; }

 private:
  using MaybeRequest = Result<std::optional<wire::Envelope>>;

  boost::asio::awaitable<void> Read();
  boost::asio::awaitable<void> Write();
  boost::asio::awaitable<void> Serve(wire::Envelope request, std::size_t bytes);
  boost::asio::awaitable<void> WatchDeadline();
  // Requests until the peer closes, breaks a rule (the error) or the connection drains.
  boost::asio::awaitable<Status> ReadRequests();
  // The next whole frame's envelope; an error ends the connection. nullopt: the peer closed.
  boost::asio::awaitable<MaybeRequest> NextRequest();
  MaybeRequest TakeRequest();
  boost::asio::awaitable<bool> Greet(wire::Envelope hello);
  boost::asio::awaitable<void> WaitForRoom();
  // Reads on and drops what comes: closing a socket with unread bytes resets it, and the peer would
  // lose the replies that are still under way.
  boost::asio::awaitable<void> Linger();
  Status Hold(std::size_t bytes);
  void Release(std::size_t bytes);
  void DropUnread();
  void ExpectFrame(bool is_mid_frame);
  void Finish();

  boost::asio::ip::tcp::socket socket_;
  RequestHandler& handler_;
  ByteBudget& budget_;
  const NetOptions& options_;
  std::string peer_;
  ReplyWriter writer_;
  FrameDecoder decoder_;
  std::size_t held_bytes_ = 0;   // of `budget_`: what was received and is not answered yet
  std::size_t frame_bytes_ = 0;  // size of the frame last decoded
  boost::asio::cancellation_signal stop_reading_;
  boost::asio::steady_timer deadline_;  // of what the peer owes next
  boost::asio::steady_timer changed_;   // cancelled when a request is done
  std::size_t requests_ = 0;
  std::size_t request_bytes_ = 0;
  bool is_greeted_ = false;
  bool is_mid_frame_ = false;
  bool is_refused_ = false;
  bool is_draining_ = false;
  bool is_reading_ = true;
};

}  // namespace atlas
