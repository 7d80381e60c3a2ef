#include "server/net/connection/peer_connection.h"

#include <exception>
#include <optional>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <spdlog/spdlog.h>

#include "core/base/str_cat.h"
#include "server/net/access/access_check.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kMaxClientBytes = 100;  // of its name that are kept for the log

Status HoldsTooMuch(std::size_t bytes, const std::string& whose) {
  return {StatusCode::kResourceExhausted,
          StrCat("the daemon holds ", bytes, " bytes of requests of ", whose,
                 " already; try again later")};
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

PeerConnection::PeerConnection(Arrival arrival, const Surroundings& surroundings)
    : stream_(std::move(arrival.socket), std::move(arrival.session)),
      place_(std::move(arrival.place)),
      handler_(surroundings.handler),
      budget_(surroundings.budget),
      limits_(surroundings.limits),
      buffer_(surroundings.buffer),
      options_(surroundings.options),
      peer_{stream_.PeerName(), "", surroundings.counters, surroundings.lines,
            options_.slow_request},
      writer_(stream_, peer_, options_),
      as_peer_(writer_, stream_.executor()),
      decoder_(options_.max_hello_bytes),
      changed_(stream_.executor(), asio::steady_timer::time_point::max()),
      frame_clock_(Clock::now(), options_),
      access_(std::move(arrival.access)),
      rate_pause_(stream_.executor()) {}

void PeerConnection::Start() {
  const auto self = shared_from_this();
  asio::co_spawn(stream_.executor(), Write(), Completion(self, "writing"));
  asio::co_spawn(stream_.executor(), Read(), Completion(self, "reading"));
}

void PeerConnection::Drain() {
  is_draining_ = true;
  stop_reading_.emit(asio::cancellation_type::terminal);
  rate_pause_.cancel();
}

void PeerConnection::CloseNow() {
  phase_ = Phase::kClosed;
  place_.reset();  // before the peer can see it
  own_place_.reset();
  writer_.CloseNow();
  changed_.cancel();
  rate_pause_.cancel();
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
      if (!stream_.failure().empty()) {
        spdlog::warn("{}", peer_.Line(StrCat("TLS: ", stream_.failure())).text());
      }
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
      if (allowance_ != nullptr) {
        co_await KeepToRate(came.bytes);
      }
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
    frame_clock_.Expect(Clock::now(), 0);
    if (!HasRoom()) {
      co_await WaitForRoom();
    }
  }
  if (is_greeted_) {
    frame_clock_.Expect(Clock::now(), decoder_.pending_bytes());
  }
  co_return Status();
}

// Answers it at once, or lets it run beside the others.
Status PeerConnection::TakeRequest(ByteSpan payload) {
  const std::size_t frame_bytes = kFrameHeaderBytes + payload.size();
  Result<wire::Envelope> envelope = ParseEnvelope(payload);
  if (!envelope) {
    return envelope.error();
  }
  auto rest = is_greeted_ ? Answer(*std::move(envelope)) : Greet(*std::move(envelope));
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

PeerConnection::MaybeAwaited PeerConnection::Greet(wire::Envelope hello) {
  peer_.client = hello.hello().client_name().substr(0, kMaxClientBytes);
  const Status status = ComeIn(hello);
  is_greeted_ = status.ok();
  is_refused_ = !is_greeted_;
  decoder_.set_max_payload_bytes(options_.max_frame_bytes);
  if (!status.ok()) {
    RequestRecord(peer_, hello).End(status);
    writer_.PushError(hello.request_id(), status);
    return std::nullopt;
  }
  return handler_.Greet(std::move(hello), identity_, writer_);
}

Status PeerConnection::ComeIn(const wire::Envelope& hello) {
  credentials_ = Credentials::Of(stream_.certificate(), hello.hello().token());
  const Result<Identity> identity = access_->Identify(credentials_, handler_.NowMs());
  if (!identity) {
    return identity.error();
  }
  ATLAS_RETURN_IF_ERROR(handler_.CheckGreeting(hello));
  identity_ = *identity;
  if (identity_.name.empty()) {
    return {};
  }
  const auto allowance = limits_.Of(identity_.name);
  own_place_ = allowance->TakeConnection();
  if (own_place_ == nullptr) {
    return {StatusCode::kUnavailable, StrCat(options_.identity_connections, " connections of ",
                                             identity_.name, " are open already; try again later")};
  }
  if (!allowance->held().Take(held_bytes_)) {
    return HoldsTooMuch(options_.identity_held_bytes, identity_.name);
  }
  allowance_ = allowance;
  return {};
}

asio::awaitable<void> PeerConnection::KeepToRate(std::size_t bytes) {
  const auto pause = allowance_->Charge(std::exchange(unpaid_requests_, 0), bytes, Clock::now());
  if (pause == Clock::duration::zero() || is_draining_ || writer_.is_closed()) {
    co_return;
  }
  is_held_up_ = true;
  rate_pause_.expires_after(pause);
  error_code ignored;  // the time is over, or so is the connection
  co_await rate_pause_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  is_held_up_ = false;
  frame_clock_.Restart(Clock::now(), decoder_.pending_bytes());
}

PeerConnection::MaybeAwaited PeerConnection::Answer(wire::Envelope request) {
  ++unpaid_requests_;
  if (const Status denied = CheckMayAsk(identity_, request); !denied.ok()) {
    RequestRecord(peer_, request).End(denied);
    writer_.PushError(request.request_id(), denied);
    return std::nullopt;
  }
  return handler_.Handle(std::move(request), as_peer_);
}

void PeerConnection::ChangeSecurity(const ServerSecurity& security) {
  access_ = security.access;
  if (!is_greeted_) {
    return;
  }
  Status status = security.tls == nullptr ? Status() : stream_.CheckCertificate(*security.tls);
  if (status.ok()) {
    const Result<Identity> identity = access_->Identify(credentials_, handler_.NowMs());
    status = identity ? Status() : identity.error();
    identity_ = identity.value_or(identity_);
  }
  if (!status.ok()) {
    const std::string what = StrCat(identity_.name, ", no longer: ", status.message());
    spdlog::warn("{}", peer_.Line(what).text());
    CloseNow();
  }
}

asio::awaitable<void> PeerConnection::Serve(asio::awaitable<void> request, std::size_t bytes) {
  co_await std::move(request);
  requests_ -= 1;
  request_bytes_ -= bytes;
  Release(bytes);
  changed_.cancel();
  if (requests_ == 0 && !frame_clock_.is_mid_frame()) {
    frame_clock_.Expect(Clock::now(), 0);
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
  frame_clock_.Restart(Clock::now(), decoder_.pending_bytes());
}

asio::awaitable<void> PeerConnection::Linger() {
  stream_.CloseSending();
  phase_ = Phase::kLingering;
  linger_until_ = Clock::now() + (is_refused_ ? options_.linger : options_.drain);
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
  if (writer_.IsStalled(now) || (phase_ == Phase::kLingering && now >= linger_until_)) {
    CloseNow();
    return;
  }
  const bool is_expected = is_reading_ && !is_held_up_ && phase_ == Phase::kOpen &&
                           (requests_ == 0 || frame_clock_.is_mid_frame());
  if (is_expected && now >= frame_clock_.deadline()) {
    const char* const what = frame_clock_.is_mid_frame()
                                 ? "the rest of a frame did not come in time"
                                 : "nothing came in time";
    spdlog::warn("{}", peer_.Line(what).text());
    CloseNow();
  }
}

Status PeerConnection::Hold(std::size_t bytes) {
  if (!budget_.Take(bytes)) {
    return HoldsTooMuch(options_.max_held_bytes, "all");
  }
  if (allowance_ != nullptr && !allowance_->held().Take(bytes)) {
    budget_.GiveBack(bytes);
    return HoldsTooMuch(options_.identity_held_bytes, identity_.name);
  }
  held_bytes_ += bytes;
  return {};
}

void PeerConnection::Release(std::size_t bytes) {
  budget_.GiveBack(bytes);
  if (allowance_ != nullptr) {
    allowance_->held().GiveBack(bytes);
  }
  held_bytes_ -= bytes;
}

// What came of a frame that nobody waits for any more.
void PeerConnection::DropUnread() {
  decoder_ = FrameDecoder(options_.max_frame_bytes);
  Release(held_bytes_ - request_bytes_);
}

void PeerConnection::Finish() {
  if (!is_reading_ && requests_ == 0) {
    writer_.CloseWhenEmpty();
  }
}

}  // namespace atlas
