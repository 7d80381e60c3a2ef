#include "client/connection/rpc_channel.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

milliseconds Until(std::chrono::steady_clock::time_point time) {
  const auto left = std::chrono::ceil<milliseconds>(time - std::chrono::steady_clock::now());
  return std::max(left, milliseconds(0));
}

}  // namespace

RpcChannel::RpcChannel(DaemonConnection connection,
                       Milliseconds frame_timeout,
                       Milliseconds max_retry_after)
    : connection_(std::move(connection)),
      frame_timeout_(frame_timeout),
      max_retry_after_(max_retry_after) {}

Result<std::uint64_t> RpcChannel::Send(wire::Envelope& request, Clock::time_point latest) {
  request.set_request_id(last_id_ + 1);
  const Result<Bytes> frame = EncodeEnvelopeFrame(request);
  if (!frame) return Error(frame.error());
  const bool is_bounded = latest != Clock::time_point::max();
  const Milliseconds time = is_bounded ? std::min(Until(latest), frame_timeout_) : frame_timeout_;
  if (Status status = connection_.Send(*frame, time); !status.ok()) {
    return Error(std::move(status));
  }
  waiting_since_ = Clock::now();
  return ++last_id_;
}

Result<wire::Envelope> RpcChannel::Receive(Milliseconds extra) {
  const Result<Bytes> payload = connection_.Receive(frame_timeout_ + extra);
  if (!payload) return Error(payload.error());
  return Read(*payload);
}

Result<wire::Envelope> RpcChannel::Read(ByteSpan payload) {
  waiting_since_ = Clock::now();
  refused_id_.reset();
  last_frame_bytes_ = kFrameHeaderBytes + payload.size();
  Result<wire::Envelope> reply = ParseEnvelope(payload);
  if (!reply) {
    return Error(reply.error().WithContext("daemon at " + connection_.endpoint().ToText()));
  }
  if (reply->has_error()) {
    refused_id_ = reply->request_id();
    NoteRetryAfter(reply->error());
  }
  if (reply->request_id() == 0 && reply->has_error()) {
    return Error(ErrorFromWire(reply->error()).status);
  }
  if (reply->request_id() == 0 || reply->request_id() > last_id_) return Error(Unexpected(*reply));
  return reply;
}

void RpcChannel::NoteRetryAfter(const wire::Error& error) {
  const RemoteError refusal = ErrorFromWire(error);
  if (!refusal.retry) return;
  const Milliseconds asked(refusal.retry_after_ms);
  retry_at_ = std::max(retry_at_, Clock::now() + std::min(asked, max_retry_after_));
}

RpcChannel::Milliseconds RpcChannel::retry_after() const {
  const Clock::time_point now = Clock::now();
  return now < retry_at_ ? std::chrono::ceil<Milliseconds>(retry_at_ - now) : Milliseconds(0);
}

Result<std::optional<wire::Envelope>> RpcChannel::AnswerTo(std::uint64_t id,
                                                           wire::Envelope reply) const {
  if (reply.request_id() < id) return std::nullopt;
  if (reply.request_id() != id) return Error(Unexpected(reply));
  if (reply.has_error()) return Error(ErrorFromWire(reply.error()).status);
  return reply;
}

Result<wire::Envelope> RpcChannel::ReceiveAnyFor(std::uint64_t id, Milliseconds extra) {
  while (true) {
    Result<wire::Envelope> reply = Receive(extra);
    if (!reply) return reply;
    Result<std::optional<wire::Envelope>> answer = AnswerTo(id, *std::move(reply));
    if (!answer) return Error(answer.error());
    if (*answer) return **std::move(answer);
  }
}

Result<std::optional<wire::Envelope>> RpcChannel::PollFor(std::uint64_t id,
                                                          Milliseconds extra,
                                                          Clock::time_point latest) {
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

Status RpcChannel::Unexpected(const wire::Envelope& reply) const {
  return {StatusCode::kInvalidData,
          StrCat("daemon at ", connection_.endpoint().ToText(), ": unexpected reply, body ",
                 static_cast<int>(reply.body_case()), " to request ", reply.request_id(), " of ",
                 last_id_)};
}

}  // namespace atlas
