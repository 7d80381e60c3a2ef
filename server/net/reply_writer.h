// The sending half of a connection: replies queue here, bounded, and leave in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <stop_token>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "core/base/status.h"
#include "proto/wire/envelope.h"
#include "server/net/net_options.h"

namespace atlas {

class ReplyWriter {
 public:
  // `socket` outlives this.
  ReplyWriter(boost::asio::ip::tcp::socket& socket, const NetOptions& options);

  // Queues one frame, after waiting for room. False when the connection is gone: stop replying.
  boost::asio::awaitable<bool> Send(Bytes frame);
  // The envelope as a frame; an envelope too large for a frame becomes an error reply.
  boost::asio::awaitable<bool> Send(wire::Envelope envelope);
  boost::asio::awaitable<bool> SendError(std::uint64_t request_id, Status status);

  // The one coroutine that writes to the socket. Returns after CloseWhenEmpty() when everything
  // queued has left, and when the connection is closed.
  boost::asio::awaitable<void> Run();
  void CloseWhenEmpty();
  void CloseNow();
  bool is_closed() const { return is_closed_; }

  // The peer sends no more or is gone: what only waits on its behalf ends.
  void NotePeerLeft() { peer_left_.request_stop(); }
  std::stop_token peer_left() const { return peer_left_.get_token(); }

 private:
  void Wake();

  boost::asio::ip::tcp::socket& socket_;
  const NetOptions& options_;
  boost::asio::steady_timer changed_;  // cancelled whenever the queue changes
  std::deque<Bytes> queue_;
  std::size_t queued_bytes_ = 0;
  bool is_finishing_ = false;
  bool is_closed_ = false;
  std::stop_source peer_left_;
};

}  // namespace atlas
