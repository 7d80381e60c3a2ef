// The sending half of a connection: replies queue here, bounded, and leave in order, several in one
// call to the system. For the thread of the connection.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <stop_token>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>

#include "core/base/status.h"
#include "proto/wire/envelope.h"
#include "server/net/net_options.h"
#include "server/net/peer_record.h"
#include "server/net/stream/peer_stream.h"
#include "server/net/stream/reply_frame.h"

namespace atlas {

class ReplyWriter {
 public:
  using Clock = std::chrono::steady_clock;

  // All outlive this.
  ReplyWriter(PeerStream& stream, const PeerRecord& peer, const NetOptions& options);

  // To whom it sends.
  const PeerRecord& peer() const { return peer_; }

  // Queues, whether there is room or not, until the next Flush(). Once closed nothing is queued.
  void Push(const ReplyFrame& frame);
  // The envelope as a frame; one too large for a frame becomes an error reply.
  void Push(const wire::Envelope& envelope);
  void PushError(std::uint64_t request_id, const Status& status);
  // Writes what the peer takes now; the rest leaves as it takes it.
  void Flush();
  // The peer takes what there is, as far as is known.
  bool has_room() const { return queued_bytes_ <= options_.max_queued_bytes; }

  // Waits for room, queues and flushes. False when the connection is gone: stop replying.
  boost::asio::awaitable<bool> Send(wire::Envelope envelope);
  // The same; what else is ready to be sent now leaves with it.
  boost::asio::awaitable<bool> SendWithOthers(wire::Envelope envelope);
  boost::asio::awaitable<bool> SendError(std::uint64_t request_id, Status status);
  boost::asio::awaitable<bool> WaitForRoom();

  // The one coroutine that waits for the peer to take more. Returns after CloseWhenEmpty() when
  // everything queued has left, and when the connection is closed.
  boost::asio::awaitable<void> Run();
  void CloseWhenEmpty();
  void CloseNow();
  bool is_closed() const { return is_closed_; }
  // The peer has taken nothing of what there is for so long.
  bool IsStalled(Clock::time_point now) const;

  // The peer sends no more or is gone: what only waits on its behalf ends.
  void NotePeerLeft() { peer_left_.request_stop(); }
  std::stop_token peer_left() const { return peer_left_.get_token(); }

 private:
  struct Piece {
    Bytes own;
    std::shared_ptr<const TileBody> tile;  // instead of these

    ByteSpan bytes() const { return tile ? tile->bytes() : own; }
  };

  void PushBytes(ByteSpan bytes);
  void TakeAway(std::size_t bytes);
  void Wake() { changed_.cancel(); }

  PeerStream& stream_;
  const PeerRecord& peer_;
  const NetOptions& options_;
  boost::asio::steady_timer changed_;  // cancelled when what Run() or a waiting reply waits for is
  std::deque<Piece> queue_;
  std::size_t sent_bytes_ = 0;  // of the first one
  std::size_t queued_bytes_ = 0;
  bool is_blocked_ = false;  // by the peer: Run() waits for it
  Clock::time_point blocked_since_;
  bool is_finishing_ = false;
  bool is_closed_ = false;
  std::stop_source peer_left_;
};

}  // namespace atlas
