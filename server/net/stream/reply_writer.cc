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

}  // namespace

ReplyWriter::ReplyWriter(PeerStream& stream, const PeerRecord& peer, const NetOptions& options)
    : stream_(stream),
      peer_(peer),
      options_(options),
      changed_(stream.executor(), asio::steady_timer::time_point::max()) {}

void ReplyWriter::Push(const ReplyFrame& frame) {
  if (is_closed_) {
    return;
  }
  PushBytes(frame.head());
  if (frame.tile()) {
    queued_bytes_ += frame.tile()->bytes().size();
    queue_.push_back({{}, frame.tile()});
    PushBytes(frame.tail());
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
  if (queue_.empty() || queue_.back().tile ||
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
    if (moved.is_closed) {
      CloseNow();
    } else if (moved.is_blocked) {
      is_blocked_ = true;
      blocked_since_ = Clock::now();
      Wake();
    }
  }
}

void ReplyWriter::TakeAway(std::size_t bytes) {
  queued_bytes_ -= bytes;
  sent_bytes_ += bytes;
  while (!queue_.empty() && sent_bytes_ >= queue_.front().bytes().size()) {
    sent_bytes_ -= queue_.front().bytes().size();
    queue_.pop_front();
  }
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
  queue_.clear();
  queued_bytes_ = 0;
  Wake();
}

bool ReplyWriter::IsStalled(Clock::time_point now) const {
  return is_blocked_ && now - blocked_since_ > options_.write_stall;
}

}  // namespace atlas
