#include "server/net/connection/peer_connection.h"

#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/base/str_cat.h"
#include "server/net/access/access_check.h"
#include "server/net/connection/completion.h"
#include "server/net/connection/reading_end.h"
#include "server/net/connection/reading_turn.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kMaxClientBytes = 100;  // of its name that are kept for the log

}  // namespace

PeerConnection::PeerConnection(Arrival arrival, const Surroundings& surroundings)
    : stream_(std::move(arrival.socket), std::move(arrival.session)),
      handler_(surroundings.handler),
      limits_(surroundings.limits),
      buffer_(surroundings.buffer),
      options_(surroundings.options),
      peer_{stream_.PeerName(),   "", "", surroundings.counters, surroundings.lines,
            options_.slow_request},
      writer_(stream_, peer_, limits_.queued, options_),
      as_peer_(writer_, stream_.executor(), options_.max_connection_watched_bytes),
      decoder_(options_.max_hello_bytes),
      held_(limits_, options_),
      changed_(stream_.executor(), asio::steady_timer::time_point::max()),
      frame_clock_(Clock::now(), options_),
      access_(stream_, limits_, options_, std::move(arrival.security), std::move(arrival.visit)),
      rate_pause_(stream_.executor()) {}

void PeerConnection::Start() {
  const auto self = shared_from_this();
  asio::co_spawn(stream_.executor(), Write(), Completion(self, "writing"));
  asio::co_spawn(stream_.executor(), Read(), Completion(self, "reading"));
}

void PeerConnection::Drain() {
  is_draining_ = true;
  writer_.EndPauses();
  stop_reading_.emit(asio::cancellation_type::terminal);
  rate_pause_.cancel();
}

void PeerConnection::CloseNow() {
  phase_ = Phase::kClosed;
  access_.GiveBackPlaces();  // before the peer can see it
  writer_.CloseNow();
  changed_.cancel();
  rate_pause_.cancel();
}

asio::awaitable<void> PeerConnection::Read() {
  const Status broken = co_await ReadRequests();
  NoteReadingEnd(peer_, stream_, broken);
  DropUnread();
  if (!broken.ok()) {
    Refuse(broken);
  }
  is_reading_ = false;
  writer_.NotePeerLeft();
  Finish();
}

asio::awaitable<Status> PeerConnection::ReadRequests() {
  ReadingTurn turn(stream_);
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
      if (Status status = held_.Take(came.bytes); !status.ok()) {
        co_return status;
      }
      decoder_.Push(buffer_.first(came.bytes));
      Status status = co_await TakeRequests();
      if (!status.ok()) {
        co_return status;
      }
      writer_.Flush();
      if (access_.allowance() != nullptr) {
        co_await KeepToRate(came.bytes);
      }
    }
    if (!is_draining_ && !is_refused_) {
      co_await turn.Next(came, stop_reading_.slot());
    }
  }
}

asio::awaitable<Status> PeerConnection::TakeRequests() {
  AnsweringTurn turn(stream_);
  while (!is_refused_ && !is_draining_ && !writer_.is_closed()) {
    Status status;
    std::optional<LargeFrame> large;
    if (is_greeted_) {
      large = decoder_.TakeLarge(options_.large_frame_bytes, is_copied_);
    }
    if (large) {
      status = co_await TakeLargeRequest(*std::move(large));
    } else {
      const auto payload = decoder_.Next();
      if (!payload) {
        co_return payload.error();
      }
      if (!*payload) {
        break;
      }
      status = TakeRequest(**payload);
    }
    if (!status.ok()) {
      co_return status;
    }
    frame_clock_.Expect(Clock::now(), 0);
    if (!HasRoom()) {
      co_await WaitForRoom();
    } else if (turn.IsOver()) {
      co_await turn.Pass();
    }
  }
  if (is_greeted_) {
    frame_clock_.Expect(Clock::now(), decoder_.pending_bytes());
  }
  co_return CountPart(decoder_.pending_bytes(), frame_clock_.deadline());
}

Status PeerConnection::CountPart(std::size_t bytes, Clock::time_point deadline) {
  return held_.CountPart(bytes, deadline, [weak = weak_from_this(), executor = stream_.executor()] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock()) {
        self->MakeRoom();
      }
    });
  });
}

void PeerConnection::MakeRoom() {
  if (phase_ == Phase::kOpen && !is_refused_) {
    Refuse(held_.NoRoomForPart());
    DropUnread();
    stop_reading_.emit(asio::cancellation_type::terminal);
    rate_pause_.cancel();
  }
}

void PeerConnection::Refuse(const Status& why) {
  peer_.Warn(why.message());
  is_refused_ = true;
  writer_.PushError(0, why);
  writer_.Flush();
}

// Answers it at once, or lets it run beside the others.
Status PeerConnection::TakeRequest(ByteSpan payload) {
  std::shared_ptr<const void> held = HoldRequest(kFrameHeaderBytes + payload.size());
  Result<wire::Envelope> envelope = ParseEnvelope(payload);
  if (!envelope) {
    return envelope.error();
  }
  if (!is_greeted_) {
    Begin(Greet(*std::move(envelope)));
    return {};
  }
  Status denied = CheckMayAsk(access_.identity(), *envelope);
  const std::size_t unfolded_bytes = UnfoldedBytes(*envelope, payload.size());
  if (denied.ok() && unfolded_bytes > 0) {
    denied = held_.TakeLarge(unfolded_bytes);
    held = Places::Both(held, denied.ok() ? HoldRequest(unfolded_bytes) : nullptr);
  }
  Begin(Answer({std::make_shared<wire::Envelope>(*std::move(envelope)), std::move(held)}, denied));
  return {};
}

// The peer's next one has to wait until this one is read, the other connections have not.
asio::awaitable<Status> PeerConnection::TakeLargeRequest(LargeFrame frame) {
  std::shared_ptr<const void> held = HoldRequest(frame.size());
  if (Status full = CountPart(frame.size(), Clock::time_point::max()); !full.ok()) {
    co_return full;
  }
  writer_.Flush();
  is_held_up_ = true;
  auto read = co_await handler_.ReadLarge(std::move(frame), access_.identity());
  is_held_up_ = false;
  frame_clock_.Restart(Clock::now(), decoder_.pending_bytes());
  if (!read) {
    co_return read.error();
  }
  held.reset();  // the frame is gone; now it counts as what was made of it
  if (Status full = held_.TakeLarge(read->bytes + read->reply_bytes); !full.ok()) {
    read->denied = std::move(full);
  } else {
    read->request.held = HoldRequest(read->bytes);
    read->request.held_reply = HoldRequest(read->reply_bytes);
  }
  if (!writer_.is_closed()) {
    Begin(Answer(std::move(read->request), read->denied));
  }
  co_return Status();
}

void PeerConnection::Begin(MaybeAwaited rest) {
  if (rest) {
    requests_ += 1;
    asio::co_spawn(stream_.executor(), Serve(*std::move(rest)),
                   Completion(shared_from_this(), "a request"));
  }
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
  return handler_.Greet(std::move(hello), access_.identity(), writer_);
}

Status PeerConnection::ComeIn(const wire::Envelope& hello) {
  ATLAS_RETURN_IF_ERROR(access_.Identify(hello.hello().token(), handler_.NowMs()));
  peer_.KnowAs(access_.identity());
  ATLAS_RETURN_IF_ERROR(handler_.CheckGreeting(hello));
  ATLAS_RETURN_IF_ERROR(access_.TakePlace());
  if (access_.allowance() == nullptr) {
    return {};
  }
  peer_.share = access_.allowance()->share();
  return held_.CountByName(access_.allowance());
}

asio::awaitable<void> PeerConnection::KeepToRate(std::size_t bytes) {
  const auto pause =
      access_.allowance()->Charge(std::exchange(unpaid_requests_, 0), bytes, Clock::now());
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

PeerConnection::MaybeAwaited PeerConnection::Answer(Request request, const Status& denied) {
  ++unpaid_requests_;
  if (!denied.ok()) {
    const wire::Envelope& message = *request.message;
    handler_.NoteDenied(message, denied, as_peer_);
    RequestRecord(peer_, message, request.began).End(denied);
    writer_.PushError(message.request_id(), denied);
    return std::nullopt;
  }
  return handler_.Handle(std::move(request), as_peer_);
}

void PeerConnection::ChangeSecurity(const ServerSecurity& security) {
  access_.set_security(security);
  if (is_greeted_) {
    CheckIdentity();
  }
}

void PeerConnection::CheckIdentity() {
  if (const Status now = access_.IdentifyAgain(handler_.NowMs()); !now.ok()) {
    peer_.Warn(StrCat(access_.identity().name, ", no longer: ", now.message()));
    CloseNow();
  }
}

asio::awaitable<void> PeerConnection::Serve(asio::awaitable<void> request) {
  co_await std::move(request);
  requests_ -= 1;
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
         request_bytes_ <= held_.max_request_bytes() && writer_.has_room();
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
  ReadingTurn turn(stream_);
  while (phase_ == Phase::kLingering) {
    const PeerStream::Moved came = stream_.Read(buffer_);
    if (came.is_closed) {
      break;
    }
    co_await turn.Next(came, {});
  }
}

void PeerConnection::CheckDeadlines(Clock::time_point now) {
  if (phase_ == Phase::kLingering && now >= linger_until_) {
    CloseNow();
  }
  if (phase_ != Phase::kClosed && is_greeted_ && access_.IsDue(now)) {
    CheckIdentity();
  }
  if (phase_ == Phase::kClosed) {
    return;
  }
  if (const std::optional<Lateness> late = WhatIsLate(now)) {
    const auto index = static_cast<std::size_t>(*late);
    peer_.Warn(kLatenessTexts[index]);
    peer_.counters.late_connections[index].Add();
    CloseNow();
  }
}

std::optional<Lateness> PeerConnection::WhatIsLate(Clock::time_point now) {
  if (writer_.IsStalled(now)) {
    stream_.DropUnsent();  // else the system would keep it for as long as the peer likes
    return Lateness::kReplies;
  }
  const bool is_expected = is_reading_ && !is_held_up_ && phase_ == Phase::kOpen &&
                           (requests_ == 0 || frame_clock_.is_mid_frame());
  if (!is_expected || now < frame_clock_.deadline()) {
    return std::nullopt;
  }
  return frame_clock_.is_mid_frame() ? Lateness::kFrame : Lateness::kSilence;
}

std::shared_ptr<const void> PeerConnection::HoldRequest(std::size_t bytes) {
  request_bytes_ += bytes;
  return {this, [self = shared_from_this(), bytes](const void*) {
            self->request_bytes_ -= bytes;
            self->held_.GiveBack(bytes);
            self->changed_.cancel();
          }};
}

// What came of a frame that nobody waits for any more.
void PeerConnection::DropUnread() {
  decoder_ = FrameDecoder(options_.max_frame_bytes);
  held_.GiveBack(held_.bytes() - request_bytes_);
  held_.DropPart();
}

void PeerConnection::Finish() {
  if (!is_reading_ && requests_ == 0) {
    writer_.CloseWhenEmpty();
  }
}

}  // namespace atlas
