#include "client/connection/rpc_channel.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {

RpcChannel::RpcChannel(DaemonConnection connection,
                       Milliseconds frame_timeout,
                       Milliseconds max_retry_after)
    : connection_(std::move(connection)),
      frame_timeout_(frame_timeout),
      max_retry_after_(max_retry_after) {}

Result<std::uint64_t> RpcChannel::Send(wire::Envelope& request) {
  request.set_request_id(last_id_ + 1);
  const Result<Bytes> frame = EncodeEnvelopeFrame(request);
  if (!frame) return Error(frame.error());
  if (Status status = connection_.Send(*frame, frame_timeout_); !status.ok()) {
    return Error(std::move(status));
  }
  return ++last_id_;
}

Result<wire::Envelope> RpcChannel::Receive(Milliseconds extra) {
  const Result<Bytes> payload = connection_.Receive(frame_timeout_ + extra);
  if (!payload) return Error(payload.error());
  last_frame_bytes_ = kFrameHeaderBytes + payload->size();
  Result<wire::Envelope> reply = ParseEnvelope(*payload);
  if (!reply) {
    return Error(reply.error().WithContext("daemon at " + connection_.endpoint().ToText()));
  }
  if (reply->has_error()) NoteRetryAfter(reply->error());
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

Result<wire::Envelope> RpcChannel::ReceiveAnyFor(std::uint64_t id, Milliseconds extra) {
  while (true) {
    Result<wire::Envelope> reply = Receive(extra);
    if (!reply) return reply;
    if (reply->request_id() < id) continue;
    if (reply->request_id() != id) return Error(Unexpected(*reply));
    if (reply->has_error()) return Error(ErrorFromWire(reply->error()).status);
    return reply;
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
