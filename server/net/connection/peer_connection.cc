#include "server/net/connection/peer_connection.h"

#include <exception>
#include <optional>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kMaxClientBytes = 100;  // of its name that are kept for the log

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
      const std::string message = StrCat(what_, " failed: ", error.what());
      spdlog::error("{}", connection_->peer().Line(message).text());
    }
    connection_->CloseNow();
  }

 private:
  std::shared_ptr<PeerConnection> connection_;
  const char* what_;
};

}  // namespace

PeerConnection::PeerConnection(asio::ip::tcp::socket socket,
                               Places::Place place,
                               const Surroundings& surroundings)
    : stream_(std::move(socket)),
      place_(std::move(place)),
      handler_(surroundings.handler),
      budget_(surroundings.budget),
      buffer_(surroundings.buffer),
      options_(surroundings.options),
      peer_{stream_.PeerName(), "", surroundings.counters, surroundings.lines,
            options_.slow_request},
      writer_(stream_, peer_, options_),
      decoder_(options_.max_hello_bytes),
      changed_(stream_.executor(), asio::steady_timer::time_point::max()),
      deadline_(Clock::now() + options_.handshake) {}

void PeerConnection::Start() {
  const auto self = shared_from_this();
  asio::co_spawn(stream_.executor(), Write(), Completion(self, "writing"));
  asio::co_spawn(stream_.executor(), Read(), Completion(self, "reading"));
}

void PeerConnection::Drain() {
  is_draining_ = true;
  stop_reading_.emit(asio::cancellation_type::terminal);
}

void PeerConnection::CloseNow() {
  phase_ = Phase::kClosed;
  place_.reset();  // before the peer can see it
  writer_.CloseNow();
  changed_.cancel();
}

asio::awaitable<void> PeerConnection::Read() {
  const Status broken = co_await ReadRequests();
  DropUnread();
  if (!broken.ok()) {
    spdlog::warn("{}", peer_.Line(broken.message()).text());
    is_refused_ = true;
    writer_.PushError(0, broken);
  }
  is_reading_ = false;
  writer_.NotePeerLeft();
  Finish();
}

asio::awaitable<Status> PeerConnection::ReadRequests() {
  while (true) {
    if (!HasRoom()) {
      co_await WaitForRoom();
    }
    if (is_draining_ || is_refused_ || writer_.is_closed()) {
      co_return Status();
    }
    const PeerStream::Moved came = stream_.Read(buffer_);
    if (came.is_closed) {
      co_return Status();
    }
    if (came.bytes > 0) {
      peer_.counters.received_bytes.Add(came.bytes);
      if (Status status = Hold(came.bytes); !status.ok()) {
        co_return status;
      }
      decoder_.Push(buffer_.first(came.bytes));
      Status status = co_await TakeRequests();
      if (!status.ok()) {
        co_return status;
      }
      writer_.Flush();
    }
    if (came.is_blocked && !is_draining_ && !is_refused_) {
      co_await stream_.WaitUntilReadable(stop_reading_.slot());
    }
  }
}

asio::awaitable<Status> PeerConnection::TakeRequests() {
  while (!is_refused_ && !is_draining_ && !writer_.is_closed()) {
    const auto payload = decoder_.Next();
    if (!payload) {
      co_return payload.error();
    }
    if (!*payload) {
      break;
    }
    Status status = TakeRequest(**payload);
    if (!status.ok()) {
      co_return status;
    }
    is_mid_frame_ = false;
    if (!HasRoom()) {
      co_await WaitForRoom();
    }
  }
  ExpectFrame();
  co_return Status();
}

// Answers it at once, or lets it run beside the others.
Status PeerConnection::TakeRequest(ByteSpan payload) {
  const std::size_t frame_bytes = kFrameHeaderBytes + payload.size();
  Result<wire::Envelope> envelope = ParseEnvelope(payload);
  if (!envelope) {
    return envelope.error();
  }
  if (!is_greeted_) {
    peer_.client = envelope->hello().client_name().substr(0, kMaxClientBytes);
    is_greeted_ = handler_.Greet(*envelope, writer_);
    is_refused_ = !is_greeted_;
    decoder_.set_max_payload_bytes(options_.max_frame_bytes);
    Release(frame_bytes);
    return {};
  }
  auto rest = handler_.Handle(*std::move(envelope), writer_);
  if (!rest) {
    Release(frame_bytes);
    return {};
  }
  requests_ += 1;
  request_bytes_ += frame_bytes;
  asio::co_spawn(stream_.executor(), Serve(*std::move(rest), frame_bytes),
                 Completion(shared_from_this(), "a request"));
  return {};
}

asio::awaitable<void> PeerConnection::Serve(asio::awaitable<void> request, std::size_t bytes) {
  co_await std::move(request);
  requests_ -= 1;
  request_bytes_ -= bytes;
  Release(bytes);
  changed_.cancel();
  if (requests_ == 0 && !is_mid_frame_) {
    ExpectFrame();
  }
  Finish();
}

asio::awaitable<void> PeerConnection::Write() {
  co_await writer_.Run();
  if (!writer_.is_closed() && (is_refused_ || stream_.has_unread())) {
    co_await Linger();
  }
  CloseNow();
}

// For one more request, and for its replies.
bool PeerConnection::HasRoom() const {
  return requests_ < options_.max_requests_in_flight &&
         request_bytes_ <= options_.max_received_bytes && writer_.has_room();
}

asio::awaitable<void> PeerConnection::WaitForRoom() {
  is_held_up_ = true;
  while (!writer_.is_closed() && !HasRoom()) {
    if (!writer_.has_room()) {
      co_await writer_.WaitForRoom();
      continue;
    }
    writer_.Flush();
    error_code ignored;  // woken by cancelling
    co_await changed_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }
  is_held_up_ = false;
  is_mid_frame_ = false;  // its clock begins anew
  ExpectFrame();
}

asio::awaitable<void> PeerConnection::Linger() {
  stream_.CloseSending();
  phase_ = Phase::kLingering;
  deadline_ = Clock::now() + (is_refused_ ? options_.linger : options_.drain);
  while (phase_ == Phase::kLingering) {
    const PeerStream::Moved came = stream_.Read(buffer_);
    if (came.is_closed) {
      break;
    }
    if (came.is_blocked) {
      co_await stream_.WaitUntilReadable({});
    }
  }
}

void PeerConnection::CheckDeadlines(Clock::time_point now) {
  if (phase_ == Phase::kClosed) {
    return;
  }
  if (writer_.IsStalled(now)) {
    CloseNow();
    return;
  }
  if (now < deadline_) {
    return;
  }
  if (phase_ == Phase::kLingering) {
    CloseNow();
  } else if (is_reading_ && !is_held_up_ && (requests_ == 0 || is_mid_frame_)) {
    const char* const what =
        is_mid_frame_ ? "the rest of a frame did not come in time" : "nothing came in time";
    spdlog::warn("{}", peer_.Line(what).text());
    CloseNow();
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

// Sets the clock of the next frame, or of the rest of one: what has come of it buys time for the
// rest. The Hello's runs from the start.
void PeerConnection::ExpectFrame() {
  const Clock::time_point now = Clock::now();
  const std::size_t part_bytes = decoder_.pending_bytes();
  if (part_bytes > 0 && !is_mid_frame_) {
    frame_began_ = now;
  }
  is_mid_frame_ = part_bytes > 0;
  if (is_greeted_) {
    const auto bought = std::chrono::milliseconds(1'000 * part_bytes / options_.min_bytes_per_s);
    deadline_ = is_mid_frame_ ? frame_began_ + options_.frame + bought : now + options_.idle;
  }
}

void PeerConnection::Finish() {
  if (!is_reading_ && requests_ == 0) {
    writer_.CloseWhenEmpty();
  }
}

}  // namespace atlas
