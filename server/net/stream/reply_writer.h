// The sending half of a connection: replies queue here, bounded, and leave in order, several in one
// call to the system. For the thread of the connection.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <stop_token>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>

#include "core/base/status.h"
#include "proto/wire/envelope.h"
#include "server/net/byte_budget.h"
#include "server/net/net_options.h"
#include "server/net/peer_record.h"
#include "server/net/stream/peer_stream.h"
#include "server/net/stream/reply_frame.h"
#include "server/net/stream/write_pace.h"

namespace atlas {

// Of a reply of many frames that are made at a time.
inline constexpr std::size_t kReplyBatchBytes = 512u << 10;

class ReplyWriter {
 public:
  using Clock = std::chrono::steady_clock;

  // Set aside for frames that are being made, until it is destroyed. The writer outlives it.
  class Room {
   public:
    Room() = default;  // none: the connection is gone
    Room(ReplyWriter& writer, std::size_t bytes) : writer_(&writer), bytes_(bytes) {
      writer.Reserve(bytes);
    }
    Room(Room&& other) noexcept
        : writer_(std::exchange(other.writer_, nullptr)), bytes_(other.bytes_) {}
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;
    Room& operator=(Room&&) = delete;
    ~Room() {
      if (writer_ != nullptr) {
        writer_->GiveBack(bytes_);
      }
    }

    explicit operator bool() const { return writer_ != nullptr; }
    std::size_t bytes() const { return bytes_; }
    // What became of a reply for which there is none.
    static Status Gone() {
      return {StatusCode::kUnavailable, "the connection was closed before the reply was sent"};
    }

   private:
    ReplyWriter* writer_ = nullptr;
    std::size_t bytes_ = 0;
  };

  // Memory of a reply under way besides its frames: counts as if it were queued, for all and not
  // for this connection, until it is destroyed. The writer outlives it.
  class Kept {
   public:
    explicit Kept(ReplyWriter& writer) : writer_(writer) {}
    Kept(const Kept&) = delete;
    Kept& operator=(const Kept&) = delete;
    ~Kept() { Set(0); }

    void Set(std::size_t bytes) {
      writer_.kept_bytes_ += bytes - std::exchange(bytes_, bytes);
      writer_.Count();
    }

   private:
    ReplyWriter& writer_;
    std::size_t bytes_ = 0;
  };

  // All outlive this; `all`: what is queued on all connections.
  ReplyWriter(PeerStream& stream,
              const PeerRecord& peer,
              ByteBudget& all,
              const NetOptions& options);
  ReplyWriter(const ReplyWriter&) = delete;
  ReplyWriter& operator=(const ReplyWriter&) = delete;
  ~ReplyWriter() { all_.GiveBack(counted_bytes_); }

  // To whom it sends.
  const PeerRecord& peer() const { return peer_; }

  // Queues, whether there is room or not, until the next Flush(). Once closed nothing is queued.
  // `held`: a large frame without a tile counts elsewhere, until this is dropped with it, and not
  // among what all queue.
  void Push(ReplyFrame frame, std::shared_ptr<const void> held = nullptr);
  // The envelope as a frame; one too large for a frame becomes an error reply.
  void Push(const wire::Envelope& envelope);
  void PushError(std::uint64_t request_id, const Status& status);
  // Writes what the peer takes now; the rest leaves as it takes it.
  void Flush();
  // The peer takes what there is, as far as is known.
  bool has_room() const { return queued_bytes_ == 0 || queued_bytes_ <= max_bytes(); }
  // As many bytes as the next frames of a reply may have now, and one frame more; 0: it has to
  // wait.
  std::size_t RoomNow();
  // What a reply may keep besides its frames: the less, the more the others have.
  std::size_t share_bytes() const { return all_.share_bytes(); }

  // Waits for room, queues and flushes. False when the connection is gone: stop replying.
  boost::asio::awaitable<bool> Send(wire::Envelope envelope);
  // The same; what else is ready to be sent now leaves with it.
  boost::asio::awaitable<bool> SendWithOthers(wire::Envelope envelope);
  boost::asio::awaitable<bool> SendError(std::uint64_t request_id, Status status);
  boost::asio::awaitable<bool> WaitForRoom();
  // Waits for room, and until its name has paid for what it was sent, and sets it aside, up to
  // `wanted_bytes`, of which there may be less; none where all have taken everything: then whoever
  // has nothing queued makes one frame at a time. Made before they have room, frames would be
  // bounded by nothing.
  boost::asio::awaitable<Room> TakeRoom(std::size_t wanted_bytes);

  // The one coroutine that waits for the peer to take more. Returns after CloseWhenEmpty() when
  // everything queued has left, and when the connection is closed.
  boost::asio::awaitable<void> Run();
  void CloseWhenEmpty();
  // From now on its name may owe: what is left is to be sent soon.
  void EndPauses() { has_pauses_ = false; }
  void CloseNow();
  bool is_closed() const { return is_closed_; }
  // The peer has taken too little of what there is for so long.
  bool IsStalled(Clock::time_point now);

  // The peer sends no more or is gone: what only waits on its behalf ends.
  void NotePeerLeft() { peer_left_.request_stop(); }
  std::stop_token peer_left() const { return peer_left_.get_token(); }

 private:
  struct Piece {
    Bytes own;
    std::shared_ptr<const TileBody> tile;  // instead of these
    std::shared_ptr<const void> held;      // these count elsewhere

    ByteSpan bytes() const { return tile ? tile->bytes() : own; }
  };

  void PushBytes(ByteSpan bytes);
  void Pay();
  // That its name has to wait, or to be asked again then.
  Clock::duration Pause();
  void TakeAway(std::size_t bytes);
  void Wake() { changed_.cancel(); }
  // That may be queued now: the less, the more the others have.
  std::size_t max_bytes() const { return std::min(options_.max_queued_bytes, all_.share_bytes()); }
  // Of frames that are made at a time.
  std::size_t BatchBytes(std::size_t wanted_bytes) const;
  bool Fits(std::size_t bytes) const {
    const std::size_t taken_bytes = queued_bytes_ + reserved_bytes_;
    return taken_bytes == 0 || taken_bytes + bytes <= max_bytes();
  }
  void Reserve(std::size_t bytes);
  void GiveBack(std::size_t bytes);
  // Among all's.
  void Count();
  std::int64_t TakenByPeer();

  PeerStream& stream_;
  const PeerRecord& peer_;
  ByteBudget& all_;
  const NetOptions& options_;
  boost::asio::steady_timer changed_;  // cancelled when what Run() or a waiting reply waits for is
  std::deque<Piece> queue_;
  std::size_t sent_bytes_ = 0;  // of the first one
  std::size_t queued_bytes_ = 0;
  std::size_t reserved_bytes_ = 0;
  std::size_t kept_bytes_ = 0;
  std::size_t held_bytes_ = 0;     // of those queued: in pieces that count elsewhere
  std::size_t counted_bytes_ = 0;  // of these among all's
  std::size_t unpaid_bytes_ = 0;   // that were queued
  std::int64_t written_bytes_ = 0;
  bool is_blocked_ = false;  // by the peer: Run() waits for it
  WritePace pace_;           // of the peer, while something waits
  bool has_pauses_ = true;
  bool is_finishing_ = false;
  bool is_closed_ = false;
  std::stop_source peer_left_;
};

}  // namespace atlas
