#include "server/net/stream/reply_writer.h"

#include <algorithm>
#include <array>
#include <utility>

#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "proto/wire/convert.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kGatheredBytes = 4u << 10;  // small pieces become one up to here
// Who pauses looks again: the connection may be gone, or the rate another one.
constexpr std::chrono::milliseconds kLongestPause{100};

}  // namespace

ReplyWriter::ReplyWriter(PeerStream& stream,
                         const PeerRecord& peer,
                         ByteBudget& all,
                         const NetOptions& options)
    : stream_(stream),
      peer_(peer),
      all_(all),
      options_(options),
      changed_(stream.executor(), asio::steady_timer::time_point::max()),
      pace_(options) {}

void ReplyWriter::Push(ReplyFrame frame, std::shared_ptr<const void> held) {
  if (is_closed_) {
    return;
  }
  unpaid_bytes_ += frame.size();
  if (frame.tile()) {
    PushBytes(frame.head());
    queued_bytes_ += frame.tile()->bytes().size();
    queue_.push_back({{}, frame.tile(), nullptr});
    PushBytes(frame.tail());
  } else if (frame.size() > kGatheredBytes) {
    queued_bytes_ += frame.size();
    held_bytes_ += held ? frame.size() : 0;
    queue_.push_back({std::move(frame).TakeWhole(), nullptr, std::move(held)});
  } else {
    PushBytes(frame.head());
  }
}

void ReplyWriter::Push(const wire::Envelope& envelope) {
  Result<Bytes> frame = EncodeEnvelopeFrame(envelope);
  if (!frame) {
    PushError(envelope.request_id(), frame.error());
    return;
  }
  Push(ReplyFrame(*std::move(frame)));
}

void ReplyWriter::PushError(std::uint64_t request_id, const Status& status) {
  wire::Envelope envelope;
  envelope.set_request_id(request_id);
  *envelope.mutable_error() = ErrorToWire(status);
  Push(envelope);
}

void ReplyWriter::PushBytes(ByteSpan bytes) {
  queued_bytes_ += bytes.size();
  if (queue_.empty() || queue_.back().tile || queue_.back().held ||
      queue_.back().own.size() + bytes.size() > kGatheredBytes) {
    queue_.emplace_back();
  }
  Bytes& last = queue_.back().own;
  last.insert(last.end(), bytes.begin(), bytes.end());
}

void ReplyWriter::Flush() {
  while (!queue_.empty() && !is_blocked_ && !is_closed_) {
    std::array<ByteSpan, PeerStream::kMaxPieces> pieces;
    const std::size_t count = std::min(queue_.size(), pieces.size());
    for (std::size_t i = 0; i < count; ++i) {
      pieces[i] = queue_[i].bytes();
    }
    pieces[0] = pieces[0].subspan(sent_bytes_);
    const PeerStream::Moved moved = stream_.Write(std::span(pieces).first(count));
    TakeAway(moved.bytes);
    peer_.counters.sent_bytes.Add(moved.bytes);
    written_bytes_ += static_cast<std::int64_t>(moved.bytes);
    if (moved.is_closed) {
      CloseNow();
    } else if (moved.is_blocked) {
      is_blocked_ = true;
      if (!pace_.is_running()) {
        pace_.Begin(Clock::now(), TakenByPeer());
      }
      Wake();
    }
  }
  if (queue_.empty()) {
    pace_.End();
  }
  Count();
  Pay();
}

void ReplyWriter::TakeAway(std::size_t bytes) {
  queued_bytes_ -= bytes;
  sent_bytes_ += bytes;
  while (!queue_.empty() && sent_bytes_ >= queue_.front().bytes().size()) {
    const Piece& sent = queue_.front();
    sent_bytes_ -= sent.bytes().size();
    held_bytes_ -= sent.held ? sent.own.size() : 0;
    queue_.pop_front();
  }
}

void ReplyWriter::Reserve(std::size_t bytes) {
  reserved_bytes_ += bytes;
  unpaid_bytes_ += bytes;
  Count();
  Pay();
}

void ReplyWriter::GiveBack(std::size_t bytes) {
  reserved_bytes_ -= bytes;
  Count();
  Pay();
  if (peer_.share != nullptr) {
    peer_.share->served.Refund(bytes, Clock::now());
  }
  Wake();
}

void ReplyWriter::Pay() {
  const std::size_t bytes = std::exchange(unpaid_bytes_, 0);
  if (bytes > 0 && peer_.share != nullptr) {
    peer_.share->served.Charge(bytes, Clock::now());
  }
}

ReplyWriter::Clock::duration ReplyWriter::Pause() {
  if (peer_.share == nullptr || !has_pauses_) {
    return Clock::duration::zero();
  }
  Pay();
  return std::min<Clock::duration>(peer_.share->served.Pause(Clock::now()), kLongestPause);
}

// What leaves at once is never counted: that would cost the threads a shared number a reply.
void ReplyWriter::Count() {
  const std::size_t sent_of_held = !queue_.empty() && queue_.front().held ? sent_bytes_ : 0;
  const std::size_t queued_bytes = queued_bytes_ - (held_bytes_ - sent_of_held);
  const std::size_t bytes = queued_bytes + reserved_bytes_ + kept_bytes_;
  if (bytes > counted_bytes_) {
    all_.Add(bytes - counted_bytes_);
  } else if (bytes < counted_bytes_) {
    all_.GiveBack(counted_bytes_ - bytes);
  }
  counted_bytes_ = bytes;
}

std::size_t ReplyWriter::BatchBytes(std::size_t wanted_bytes) const {
  const std::size_t bytes = std::min(wanted_bytes, max_bytes());
  return peer_.share == nullptr ? bytes : std::min(bytes, peer_.share->served.batch_bytes());
}

std::size_t ReplyWriter::RoomNow() {
  const auto batch = [this] {
    return std::max<std::size_t>(1, BatchBytes(kReplyBatchBytes));
  };
  if (Pause() > Clock::duration::zero()) {
    return 0;
  }
  if (!Fits(batch())) {
    Flush();
  }
  return !is_closed_ && Fits(batch()) ? batch() : 0;
}

asio::awaitable<ReplyWriter::Room> ReplyWriter::TakeRoom(std::size_t wanted_bytes) {
  asio::steady_timer paid(stream_.executor());
  while (!is_closed_) {
    if (const Clock::duration pause = Pause(); pause > Clock::duration::zero()) {
      paid.expires_after(pause);
      co_await paid.async_wait(asio::use_awaitable);
      continue;
    }
    const std::size_t bytes = BatchBytes(wanted_bytes);
    if (Fits(bytes)) {
      co_return Room(*this, bytes);
    }
    Flush();
    if (!Fits(bytes)) {
      error_code ignored;  // woken by cancelling
      co_await changed_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    }
  }
  co_return Room();
}

asio::awaitable<bool> ReplyWriter::WaitForRoom() {
  while (!is_closed_ && !has_room()) {
    Flush();
    if (has_room()) {
      break;
    }
    error_code ignored;  // woken by cancelling
    co_await changed_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }
  co_return !is_closed_;
}

asio::awaitable<bool> ReplyWriter::Send(wire::Envelope envelope) {
  const bool is_open = co_await WaitForRoom();
  if (is_open) {
    Push(envelope);
    Flush();
  }
  co_return is_open && !is_closed_;
}

asio::awaitable<bool> ReplyWriter::SendWithOthers(wire::Envelope envelope) {
  const bool is_open = co_await WaitForRoom();
  if (is_open) {
    Push(envelope);
    co_await asio::post(stream_.executor(), asio::use_awaitable);  // after what is ready
    Flush();
  }
  co_return is_open && !is_closed_;
}

asio::awaitable<bool> ReplyWriter::SendError(std::uint64_t request_id, Status status) {
  const bool is_open = co_await WaitForRoom();
  if (is_open) {
    PushError(request_id, status);
    Flush();
  }
  co_return is_open && !is_closed_;
}

asio::awaitable<void> ReplyWriter::Run() {
  while (!is_closed_) {
    if (is_blocked_) {
      co_await stream_.WaitUntilWritable();
      is_blocked_ = false;
      Flush();
      Wake();
    } else if (is_finishing_ && queue_.empty()) {
      break;
    } else {
      error_code ignored;  // woken by cancelling
      co_await changed_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
    }
  }
}

void ReplyWriter::CloseWhenEmpty() {
  is_finishing_ = true;
  Flush();
  Wake();
}

void ReplyWriter::CloseNow() {
  if (is_closed_) {
    return;
  }
  is_closed_ = true;
  NotePeerLeft();
  stream_.Close();
  const auto unsent = std::exchange(queue_, {});
  queued_bytes_ = 0;
  held_bytes_ = 0;
  sent_bytes_ = 0;
  Count();
  Wake();
}

// What the system still keeps for it is not taken: on a slow link that changes first.
std::int64_t ReplyWriter::TakenByPeer() {
  return written_bytes_ - static_cast<std::int64_t>(stream_.unacknowledged_bytes());
}

bool ReplyWriter::IsStalled(Clock::time_point now) {
  return pace_.IsDue(now) && pace_.WasTooSlow(now, TakenByPeer());
}

}  // namespace atlas
