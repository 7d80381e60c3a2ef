#include "server/net/peer_connection.h"

#include <array>
#include <exception>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kReadBytes = 16u << 10;

std::string PeerName(const asio::ip::tcp::socket& socket) {
  error_code error;
  const auto endpoint = socket.remote_endpoint(error);
  return error ? "unknown" : StrCat(endpoint);
}

// The one place where what escapes a coroutine is caught. It keeps the connection alive until then.
class Completion {
 public:
  Completion(std::shared_ptr<PeerConnection> connection, const char* what)
      : connection_(std::move(connection)), what_(what) {}

  void operator()(std::exception_ptr failure) const {
    if (!failure) {
      return;
    }
    try {
      std::rethrow_exception(failure);
    } catch (const std::exception& error) {
      spdlog::error("{}: {} failed: {}", connection_->peer(), what_, error.what());
    }
    connection_->CloseNow();
  }

 private:
  std::shared_ptr<PeerConnection> connection_;
  const char* what_;
};

}  // namespace

PeerConnection::PeerConnection(asio::ip::tcp::socket socket,
                               RequestHandler& handler,
                               const NetOptions& options)
    : socket_(std::move(socket)),
      handler_(handler),
      options_(options),
      peer_(PeerName(socket_)),
      writer_(socket_, options_),
      decoder_(options.max_frame_bytes),
      deadline_(socket_.get_executor()),
      changed_(socket_.get_executor(), asio::steady_timer::time_point::max()) {}

void PeerConnection::Start() {
  deadline_.expires_after(options_.handshake);
  const auto self = shared_from_this();
  asio::co_spawn(socket_.get_executor(), writer_.Run(), Completion(self, "writing"));
  asio::co_spawn(socket_.get_executor(), WatchDeadline(), Completion(self, "the deadline"));
  asio::co_spawn(socket_.get_executor(), Read(), Completion(self, "reading"));
}

void PeerConnection::Drain() {
  is_draining_ = true;
  error_code ignored;  // already closed
  socket_.cancel(ignored);
  changed_.cancel();
  Finish();
}

asio::awaitable<void> PeerConnection::Read() {
  bool is_greeted = false;
  while (!is_draining_ && !writer_.is_closed()) {
    Result<std::optional<wire::Envelope>> request = co_await NextRequest();
    if (!request) {
      spdlog::warn("{}: {}", peer_, request.error().message());
      co_await writer_.SendError(0, request.error());
      break;
    }
    if (!*request) {
      break;
    }
    if (!is_greeted) {
      is_greeted = co_await handler_.Greet(std::move(**request), writer_);
      if (!is_greeted) {
        break;
      }
      continue;
    }
    requests_ += 1;
    request_bytes_ += frame_bytes_;
    asio::co_spawn(socket_.get_executor(), Serve(std::move(**request), frame_bytes_),
                   Completion(shared_from_this(), "a request"));
    co_await WaitForRoom();
  }
  is_reading_ = false;
  Finish();
}

asio::awaitable<Result<std::optional<wire::Envelope>>> PeerConnection::NextRequest() {
  std::array<std::uint8_t, kReadBytes> chunk;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  bool is_mid_frame = false;
  while (true) {
    Result<std::optional<Bytes>> payload = decoder_.Next();
    if (!payload) {
      co_return Error(payload.error());
    }
    if (*payload) {
      frame_bytes_ = (*payload)->size();
      deadline_.expires_after(options_.idle);
      Result<wire::Envelope> envelope = ParseEnvelope(**payload);
      if (!envelope) {
        co_return Error(envelope.error());
      }
      co_return std::optional<wire::Envelope>(std::move(*envelope));
    }
    error_code error;
    const std::size_t size = co_await socket_.async_read_some(
        asio::buffer(chunk), asio::redirect_error(asio::use_awaitable, error));
    if (error) {
      co_return std::optional<wire::Envelope>();
    }
    if (!is_mid_frame) {
      is_mid_frame = true;
      deadline_.expires_after(options_.frame);
    }
    decoder_.Push(ByteSpan(chunk).first(size));
  }
}

asio::awaitable<void> PeerConnection::Serve(wire::Envelope request, std::size_t bytes) {
  co_await handler_.Handle(std::move(request), writer_);
  requests_ -= 1;
  request_bytes_ -= bytes;
  changed_.cancel();
  Finish();
}

asio::awaitable<void> PeerConnection::WaitForRoom() {
  while (!writer_.is_closed() && (requests_ >= options_.max_requests_in_flight ||
                                  request_bytes_ > options_.max_received_bytes)) {
    error_code ignored;  // woken by cancelling
    co_await changed_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }
  deadline_.expires_after(options_.idle);
}

asio::awaitable<void> PeerConnection::WatchDeadline() {
  while (!writer_.is_closed()) {
    error_code cancelled;  // the deadline moved, or the connection is done
    co_await deadline_.async_wait(asio::redirect_error(asio::use_awaitable, cancelled));
    if (!cancelled && requests_ == 0 && deadline_.expiry() <= Clock::now()) {
      spdlog::warn("{}: nothing came in time", peer_);
      writer_.CloseNow();
    } else if (!cancelled) {
      deadline_.expires_after(options_.idle);
    }
  }
}

void PeerConnection::Finish() {
  if (!is_reading_ && requests_ == 0) {
    writer_.CloseWhenEmpty();
    deadline_.cancel();
  }
}

}  // namespace atlas
