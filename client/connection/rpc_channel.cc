#include "client/connection/rpc_channel.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

milliseconds Until(std::chrono::steady_clock::time_point time) {
  const auto now = std::chrono::steady_clock::now();
  return now < time ? std::chrono::ceil<milliseconds>(time - now) : milliseconds(0);
}

}  // namespace

RpcChannel::RpcChannel(DaemonConnection connection,
                       Milliseconds frame_timeout,
                       Milliseconds max_retry_after)
    : connection_(std::move(connection)),
      frame_timeout_(frame_timeout),
      max_retry_after_(max_retry_after) {}

Result<bool> RpcChannel::IsFree(Clock::time_point latest) {
  return connection_.Flush(latest, sending_since_ + frame_timeout_);
}

Result<std::uint64_t> RpcChannel::Send(wire::Envelope& request, Clock::time_point latest) {
  const Result<bool> is_free = IsFree(latest);
  if (!is_free) return Error(is_free.error());
  if (!*is_free) {
    return Error(StatusCode::kUnavailable,
                 StrCat("daemon at ", connection_.endpoint().ToText(),
                        ": an earlier request is still being sent to it"));
  }
  Result<Bytes> frames = CancelFrames();
  if (!frames) return Error(frames.error());
  const Result<Bytes> frame = NextFrame(request);
  if (!frame) return Error(frame.error());
  frames->insert(frames->end(), frame->begin(), frame->end());
  if (Status status = connection_.Take(*std::move(frames)); !status.ok()) {
    return Error(std::move(status));
  }
  cancelled_.clear();
  last_call_ = last_id_;
  sending_since_ = waiting_since_ = Clock::now();
  const Result<bool> is_sent = IsFree(latest);
  if (!is_sent) return Error(is_sent.error());
  return last_call_;
}

Result<Bytes> RpcChannel::NextFrame(wire::Envelope& request) {
  request.set_request_id(last_id_ + 1);
  Result<Bytes> frame = EncodeEnvelopeFrame(request);
  if (frame) ++last_id_;
  return frame;
}

Result<Bytes> RpcChannel::CancelFrames() {
  Bytes frames;
  for (const std::uint64_t id : cancelled_) {
    wire::Envelope request;
    request.mutable_cancel_request()->set_request_id(id);
    const Result<Bytes> frame = NextFrame(request);
    if (!frame) return frame;
    const std::uint64_t cancel_id = last_id_;
    Listen(cancel_id, Kind::kEvent, [this, cancel_id](const wire::Envelope&) {
      Forget(cancel_id);
      return Status();
    });
    frames.insert(frames.end(), frame->begin(), frame->end());
  }
  return frames;
}

void RpcChannel::Cancel(std::uint64_t id) {
  Forget(id);
  cancelled_.push_back(id);
  const Result<bool> is_free = IsFree(Clock::now());
  if (!is_free || !*is_free) return;
  Result<Bytes> frames = CancelFrames();
  if (!frames || !connection_.Take(*std::move(frames)).ok()) return;  // so is the watch, then
  cancelled_.clear();
  sending_since_ = Clock::now();
}

Result<wire::Envelope> RpcChannel::Read(ByteSpan payload) {
  refused_id_.reset();
  last_frame_bytes_ = kFrameHeaderBytes + payload.size();
  Result<wire::Envelope> reply = ParseEnvelope(payload);
  if (!reply) {
    return Error(Break(reply.error().WithContext("daemon at " + connection_.endpoint().ToText())));
  }
  if (reply->has_error()) {
    refused_id_ = reply->request_id();
  }
  if (reply->request_id() == 0 && reply->has_error()) {
    NoteRetryAfter(reply->error(), Refused::kOther);
    return Error(Break(ErrorFromWire(reply->error()).status));
  }
  if (reply->request_id() == 0 || reply->request_id() > last_id_) return Error(Unexpected(*reply));
  const auto listening = listeners_.find(reply->request_id());
  const bool is_event = listening != listeners_.end() && listening->second.kind == Kind::kEvent;
  if (!is_event) waiting_since_ = Clock::now();
  return reply;
}

void RpcChannel::NoteRetryAfter(const wire::Error& error, Refused refused) {
  const RemoteError refusal = ErrorFromWire(error);
  if (!refusal.retry) return;
  const Milliseconds asked(refusal.status.retry_after_ms().value_or(0));
  Clock::time_point& until = refused == Refused::kUpload ? retry_upload_at_ : retry_at_;
  until = std::max(until, Clock::now() + std::min(asked, max_retry_after_));
}

RpcChannel::Milliseconds RpcChannel::retry_after() const {
  return Until(std::max(retry_upload_at_, retry_at_));
}

RpcChannel::Milliseconds RpcChannel::retry_after_of_reads() const {
  return Until(retry_at_);
}

Result<bool> RpcChannel::Tell(const wire::Envelope& reply) {
  const auto listening = listeners_.find(reply.request_id());
  if (listening == listeners_.end()) return false;
  const Listener tell = listening->second.tell;  // it may have itself forgotten
  Status status = tell(reply);
  if (!status.ok()) return Error(Break(std::move(status)));
  return true;
}

Result<bool> RpcChannel::Hear(Clock::time_point latest, Kind due) {
  const Clock::time_point never = Clock::time_point::max();
  const Clock::time_point began = Clock::now();
  while (true) {
    const Clock::time_point overdue =
        due == Kind::kAnswer ? waiting_since_ + frame_timeout_ : never;
    Result<std::optional<Bytes>> payload =
        latest <= overdue ? connection_.Poll(Until(latest)) : connection_.Receive(Until(overdue));
    if (!payload) return Error(payload.error());
    if (!*payload) return false;
    const Result<wire::Envelope> reply = Read(**payload);
    if (!reply) return Error(reply.error());
    const Result<bool> is_told = Tell(*reply);
    if (!is_told || *is_told) return is_told;
    if (reply->request_id() == last_call_) last_call_ = 0;
    if (Clock::now() >= latest) return false;
    if (due == Kind::kEvent) continue;
    if (Status status = CheckPatience(began, Milliseconds(0)); !status.ok())
      return Error(std::move(status));
  }
}

// There is always something to read, and never what is waited for.
Status RpcChannel::CheckPatience(Clock::time_point began, Milliseconds extra) {
  if (Clock::now() < std::max(began, waiting_since_) + frame_timeout_ + extra) return {};
  return Break({StatusCode::kTimeout, StrCat("daemon at ", connection_.endpoint().ToText(),
                                             ": answers everything but what it was asked")});
}

Result<std::optional<wire::Envelope>> RpcChannel::AnswerTo(std::uint64_t id, wire::Envelope reply) {
  const Result<bool> is_told = Tell(reply);
  if (!is_told) return Error(is_told.error());
  if (*is_told || reply.request_id() < id) return std::nullopt;
  if (reply.request_id() != id) return Error(Unexpected(reply));
  if (!reply.has_error()) return reply;
  NoteRetryAfter(reply.error(), Refused::kOther);
  return Error(ErrorFromWire(reply.error()).status);
}

Result<wire::Envelope> RpcChannel::ReceiveAnyFor(std::uint64_t id, Milliseconds extra) {
  waiting_since_ = Clock::now();
  Result<std::optional<wire::Envelope>> answer = PollFor(id, extra, Clock::time_point::max());
  if (!answer) return Error(answer.error());
  return **std::move(answer);
}

Result<std::optional<wire::Envelope>> RpcChannel::PollFor(std::uint64_t id,
                                                          Milliseconds extra,
                                                          Clock::time_point latest) {
  const Clock::time_point began = Clock::now();
  while (true) {
    const Clock::time_point overdue = waiting_since_ + frame_timeout_ + extra;
    Result<std::optional<Bytes>> payload =
        latest < overdue ? connection_.Poll(Until(latest)) : connection_.Receive(Until(overdue));
    if (!payload) return Error(payload.error());
    if (!*payload) return std::nullopt;
    Result<wire::Envelope> reply = Read(**payload);
    if (!reply) return Error(reply.error());
    Result<std::optional<wire::Envelope>> answer = AnswerTo(id, *std::move(reply));
    if (!answer || *answer) return answer;
    if (Clock::now() >= latest) return std::nullopt;
    if (Status status = CheckPatience(began, extra); !status.ok()) return Error(std::move(status));
  }
}

Result<wire::Envelope> RpcChannel::ReceiveFor(std::uint64_t id,
                                              wire::Envelope::BodyCase expected,
                                              wire::Envelope::BodyCase also,
                                              Milliseconds extra) {
  Result<wire::Envelope> reply = ReceiveAnyFor(id, extra);
  if (!reply) return reply;
  if (reply->body_case() != expected && reply->body_case() != also) {
    return Error(Unexpected(*reply));
  }
  return reply;
}

Result<wire::Envelope> RpcChannel::Call(wire::Envelope& request,
                                        wire::Envelope::BodyCase expected,
                                        Milliseconds extra) {
  const Result<std::uint64_t> id = Send(request);
  if (!id) return Error(id.error());
  return ReceiveFor(*id, expected, expected, extra);
}

Status RpcChannel::Unexpected(const wire::Envelope& reply) {
  return Break({StatusCode::kInvalidData,
                StrCat("daemon at ", connection_.endpoint().ToText(), ": unexpected reply, body ",
                       static_cast<int>(reply.body_case()), " to request ", reply.request_id(),
                       " of ", last_id_)});
}

Status RpcChannel::Break(Status why) {
  is_broken_ = true;
  return why;
}

}  // namespace atlas
