#include "server/net/peer_connection.h"

#include <array>
#include <exception>
#include <utility>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"
#include "server/net/watchdog.h"

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
                               ByteBudget& budget,
                               const NetOptions& options)
    : socket_(std::move(socket)),
      handler_(handler),
      budget_(budget),
      options_(options),
      peer_(PeerName(socket_)),
      writer_(socket_, options_),
      decoder_(options.max_hello_bytes),
      deadline_(socket_.get_executor()),
      changed_(socket_.get_executor(), asio::steady_timer::time_point::max()) {}

void PeerConnection::Start() {
  deadline_.expires_after(options_.handshake);
  const auto self = shared_from_this();
  asio::co_spawn(socket_.get_executor(), Write(), Completion(self, "writing"));
  asio::co_spawn(socket_.get_executor(), WatchDeadline(), Completion(self, "the deadline"));
  asio::co_spawn(socket_.get_executor(), Read(), Completion(self, "reading"));
}

void PeerConnection::Drain() {
  is_draining_ = true;
  stop_reading_.emit(asio::cancellation_type::terminal);
}

asio::awaitable<void> PeerConnection::Read() {
  Status broken = co_await ReadRequests();
  DropUnread();
  if (!broken.ok()) {
    spdlog::warn("{}: {}", peer_, broken.message());
    is_refused_ = true;
    co_await writer_.SendError(0, std::move(broken));
  }
  is_reading_ = false;
  writer_.NotePeerLeft();
  Finish();
}

asio::awaitable<Status> PeerConnection::ReadRequests() {
  while (!is_draining_ && !writer_.is_closed()) {
    MaybeRequest request = co_await NextRequest();
    if (!request) {
      co_return request.error();
    }
    if (!*request) {
      co_return Status();
    }
    if (!is_greeted_) {
      if (!co_await Greet(std::move(**request))) {
        co_return Status();
      }
      continue;
    }
    requests_ += 1;
    request_bytes_ += frame_bytes_;
    asio::co_spawn(socket_.get_executor(), Serve(std::move(**request), frame_bytes_),
                   Completion(shared_from_this(), "a request"));
    co_await WaitForRoom();
  }
  co_return Status();
}

asio::awaitable<bool> PeerConnection::Greet(wire::Envelope hello) {
  is_greeted_ = co_await handler_.Greet(std::move(hello), writer_);
  is_refused_ = !is_greeted_;
  Release(frame_bytes_);
  decoder_.set_max_payload_bytes(options_.max_frame_bytes);
  ExpectFrame(false);
  co_return is_greeted_;
}

asio::awaitable<PeerConnection::MaybeRequest> PeerConnection::NextRequest() {
  std::array<std::uint8_t, kReadBytes> chunk;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  while (true) {
    MaybeRequest request = TakeRequest();
    if (!request || *request) {
      ExpectFrame(false);
      co_return request;
    }
    if (!is_mid_frame_ && decoder_.has_part_of_a_frame()) {
      ExpectFrame(true);
    }
    error_code error;
    const std::size_t size = co_await socket_.async_read_some(
        asio::buffer(chunk),
        asio::bind_cancellation_slot(stop_reading_.slot(),
                                     asio::redirect_error(asio::use_awaitable, error)));
    if (error || is_draining_) {
      co_return std::optional<wire::Envelope>();
    }
    if (Status status = Hold(size); !status.ok()) {
      co_return Error(std::move(status));
    }
    decoder_.Push(ByteSpan(chunk).first(size));
  }
}

// nullopt: more bytes are needed.
PeerConnection::MaybeRequest PeerConnection::TakeRequest() {
  const Result<std::optional<Bytes>> payload = decoder_.Next();
  if (!payload) {
    return Error(payload.error());
  }
  if (!*payload) {
    return std::nullopt;
  }
  frame_bytes_ = kFrameHeaderBytes + (*payload)->size();
  Result<wire::Envelope> envelope = ParseEnvelope(**payload);
  if (!envelope) {
    return Error(envelope.error());
  }
  return std::optional<wire::Envelope>(std::move(*envelope));
}

asio::awaitable<void> PeerConnection::Serve(wire::Envelope request, std::size_t bytes) {
  co_await handler_.Handle(std::move(request), writer_);
  requests_ -= 1;
  request_bytes_ -= bytes;
  Release(bytes);
  changed_.cancel();
  if (requests_ == 0 && !is_mid_frame_) {
    ExpectFrame(false);
  }
  Finish();
}

asio::awaitable<void> PeerConnection::Write() {
  co_await writer_.Run();
  error_code gone;
  if (is_refused_ || socket_.available(gone) > 0) {
    co_await Linger();
  }
  writer_.CloseNow();
  deadline_.cancel();
}

asio::awaitable<void> PeerConnection::WaitForRoom() {
  while (!writer_.is_closed() && (requests_ >= options_.max_requests_in_flight ||
                                  request_bytes_ > options_.max_received_bytes)) {
    error_code ignored;  // woken by cancelling
    co_await changed_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }
}

asio::awaitable<void> PeerConnection::Linger() {
  error_code error;
  socket_.shutdown(asio::ip::tcp::socket::shutdown_send, error);
  const Watchdog limit(socket_.get_executor(), is_refused_ ? options_.linger : options_.drain,
                       [this] { CloseNow(); });
  std::array<std::uint8_t, kReadBytes> dropped;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  while (!error) {
    co_await socket_.async_read_some(asio::buffer(dropped),
                                     asio::redirect_error(asio::use_awaitable, error));
  }
}

asio::awaitable<void> PeerConnection::WatchDeadline() {
  while (!writer_.is_closed()) {
    error_code moved;  // or the connection is done
    co_await deadline_.async_wait(asio::redirect_error(asio::use_awaitable, moved));
    if (moved || writer_.is_closed()) {
      continue;
    }
    if (is_reading_ && (requests_ == 0 || is_mid_frame_)) {
      spdlog::warn(
          "{}: {}", peer_,
          is_mid_frame_ ? "the rest of a frame did not come in time" : "nothing came in time");
      writer_.CloseNow();
    } else {
      deadline_.expires_after(options_.idle);
    }
  }
}

Status PeerConnection::Hold(std::size_t bytes) {
  if (!budget_.Take(bytes)) {
    return Status(StatusCode::kResourceExhausted,
                  StrCat("the daemon holds ", options_.max_held_bytes,
                         " bytes of requests already; try again later"));
  }
  held_bytes_ += bytes;
  return {};
}

void PeerConnection::Release(std::size_t bytes) {
  budget_.GiveBack(bytes);
  held_bytes_ -= bytes;
}

// What came of a frame that nobody waits for any more.
void PeerConnection::DropUnread() {
  decoder_ = FrameDecoder(options_.max_frame_bytes);
  Release(held_bytes_ - request_bytes_);
}

// Starts the clock of the next frame, or of the rest of one. The Hello's runs from the start.
void PeerConnection::ExpectFrame(bool is_mid_frame) {
  is_mid_frame_ = is_mid_frame;
  if (is_greeted_) {
    deadline_.expires_after(is_mid_frame ? options_.frame : options_.idle);
  }
}

void PeerConnection::Finish() {
  if (!is_reading_ && requests_ == 0) {
    writer_.CloseWhenEmpty();
  }
}

}  // namespace atlas
