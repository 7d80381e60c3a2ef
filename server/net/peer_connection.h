// One peer: reads its frames, lets its requests run side by side, keeps it within its limits. Lives
// on the network thread; owned by its own coroutines.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "proto/wire/frame.h"
#include "server/net/net_options.h"
#include "server/net/reply_writer.h"
#include "server/net/request_handler.h"

namespace atlas {

class PeerConnection : public std::enable_shared_from_this<PeerConnection> {
 public:
  PeerConnection(boost::asio::ip::tcp::socket socket,
                 RequestHandler& handler,
                 const NetOptions& options);

  // Spawns the coroutines; they keep the connection alive until the peer or Drain() ends it.
  void Start();
  // Takes no further request; closes when those in flight are answered.
  void Drain();
  void CloseNow() { writer_.CloseNow(); }

  const std::string& peer() const { return peer_; }

 private:
  using Clock = std::chrono::steady_clock;

  boost::asio::awaitable<void> Read();
  boost::asio::awaitable<void> Serve(wire::Envelope request, std::size_t bytes);
  boost::asio::awaitable<void> WatchDeadline();
  // The next whole frame's envelope; an error ends the connection. nullopt: the peer closed.
  boost::asio::awaitable<Result<std::optional<wire::Envelope>>> NextRequest();
  boost::asio::awaitable<void> WaitForRoom();
  void Finish();

  boost::asio::ip::tcp::socket socket_;
  RequestHandler& handler_;
  const NetOptions& options_;
  std::string peer_;
  ReplyWriter writer_;
  FrameDecoder decoder_;
  std::size_t frame_bytes_ = 0;         // size of the frame last decoded
  boost::asio::steady_timer deadline_;  // of what the peer owes next
  boost::asio::steady_timer changed_;   // cancelled when a request is done
  std::size_t requests_ = 0;
  std::size_t request_bytes_ = 0;
  bool is_draining_ = false;
  bool is_reading_ = true;
};

}  // namespace atlas
