#include "server/net/reply_writer.h"

#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "proto/wire/convert.h"
#include "server/net/watchdog.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

}  // namespace

ReplyWriter::ReplyWriter(asio::ip::tcp::socket& socket, const NetOptions& options)
    : socket_(socket),
      options_(options),
      changed_(socket.get_executor(), asio::steady_timer::time_point::max()) {}

asio::awaitable<bool> ReplyWriter::Send(Bytes frame) {
  while (!is_closed_ && queued_bytes_ > options_.max_queued_bytes) {
    error_code ignored;
    co_await changed_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }
  if (is_closed_) {
    co_return false;
  }
  queued_bytes_ += frame.size();
  queue_.push_back(std::move(frame));
  Wake();
  co_return true;
}

asio::awaitable<bool> ReplyWriter::Send(wire::Envelope envelope) {
  Result<Bytes> frame = EncodeEnvelopeFrame(envelope);
  if (!frame) {
    return SendError(envelope.request_id(), frame.error());
  }
  return Send(std::move(*frame));
}

asio::awaitable<bool> ReplyWriter::SendError(std::uint64_t request_id, Status status) {
  wire::Envelope envelope;
  envelope.set_request_id(request_id);
  *envelope.mutable_error() = ErrorToWire(status);
  Result<Bytes> frame = EncodeEnvelopeFrame(envelope);
  return Send(frame ? std::move(*frame) : Bytes());
}

asio::awaitable<void> ReplyWriter::Run() {
  while (!is_closed_) {
    error_code error;
    if (queue_.empty()) {
      if (is_finishing_) {
        break;
      }
      co_await changed_.async_wait(asio::redirect_error(asio::use_awaitable, error));
      continue;
    }
    const Bytes frame = std::move(queue_.front());
    queue_.pop_front();
    for (std::size_t sent = 0; sent < frame.size() && !is_closed_;) {
      const Watchdog stall(socket_.get_executor(), options_.write_stall, [this] { CloseNow(); });
      sent +=
          co_await socket_.async_write_some(asio::buffer(frame.data() + sent, frame.size() - sent),
                                            asio::redirect_error(asio::use_awaitable, error));
      if (error) {
        CloseNow();
      }
    }
    queued_bytes_ -= frame.size();
    Wake();
  }
}

void ReplyWriter::CloseWhenEmpty() {
  is_finishing_ = true;
  Wake();
}

void ReplyWriter::CloseNow() {
  if (is_closed_) {
    return;
  }
  is_closed_ = true;
  NotePeerLeft();
  error_code ignored;  // a peer that is gone already
  socket_.shutdown(asio::ip::tcp::socket::shutdown_both, ignored);
  socket_.close(ignored);
  Wake();
}

void ReplyWriter::Wake() {
  changed_.cancel();
}

}  // namespace atlas
