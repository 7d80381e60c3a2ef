#include "client/connection/connect_attempt.h"

#include <utility>

#include "client/connection/rpc_channel.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

using std::chrono::milliseconds;

std::shared_ptr<NameLookup> NamesOf(const ConnectionOptions& options) {
  return options.names != nullptr ? options.names : std::make_shared<NameLookup>();
}

wire::Envelope HelloRequest(const ConnectionOptions& options) {
  wire::Envelope request;
  wire::Hello& hello = *request.mutable_hello();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_protocol_minor(kProtocolMinor);
  hello.set_client_name(options.client_name);
  hello.set_token(options.token);
  if (options.resume) {
    hello.mutable_resume()->set_vehicle(options.resume->vehicle);
    hello.mutable_resume()->set_session(options.resume->session);
  }
  if (options.expected_profile) hello.set_profile(ProfileToWire(*options.expected_profile));
  return request;
}

Status CheckVersion(const wire::HelloReply& reply, const Endpoint& endpoint) {
  if (reply.protocol_major() == kProtocolMajor) return {};
  return {StatusCode::kUnsupported,
          StrCat("daemon at ", endpoint.ToText(), ": speaks protocol ", reply.protocol_major(), '.',
                 reply.protocol_minor(), ", this build ", kProtocolMajor, '.', kProtocolMinor)};
}

AtlasIdentity IdentityFromWire(const wire::HelloReply& reply) {
  const ByteSpan id = BytesFromWire(reply.atlas_id());
  AtlasIdentity atlas;
  atlas.atlas_id.assign(id.begin(), id.end());
  atlas.epoch = reply.epoch();
  atlas.revision = reply.revision();
  atlas.protocol_minor = reply.protocol_minor();
  atlas.our_name = reply.name();
  atlas.our_role = reply.role();
  if (reply.has_last_sequence()) atlas.last_sequence = reply.last_sequence();
  return atlas;
}

}  // namespace

ConnectAttempt::ConnectAttempt(const ConnectionOptions& options)
    : options_(options),
      deadline_(Clock::now() + options.connect_timeout),
      connection_(
          std::in_place, options.endpoint, options.tls, options.allow_plaintext, NamesOf(options)) {
}
ConnectAttempt::ConnectAttempt(ConnectAttempt&&) noexcept = default;
ConnectAttempt& ConnectAttempt::operator=(ConnectAttempt&&) noexcept = default;
ConnectAttempt::~ConnectAttempt() = default;

ConnectProgress ConnectAttempt::Continue(milliseconds time) {
  const Clock::time_point latest = Clock::now() + time;
  if (channel_ == nullptr) {
    const Result<bool> is_open = Open(latest);
    if (!is_open) return Fail(is_open.error());
    if (!*is_open) return {};
  }
  Result<std::optional<AtlasClient>> client = ShakeHands(latest);
  if (!client) return Fail(client.error());
  ConnectProgress progress;
  progress.client = *std::move(client);
  return progress;
}

Result<bool> ConnectAttempt::Open(Clock::time_point latest) {
  const Result<bool> is_open = connection_->Open(latest, deadline_);
  if (!is_open || !*is_open) return is_open;
  channel_ = std::make_unique<RpcChannel>(*std::move(connection_), options_.request_timeout,
                                          options_.max_retry_after);
  connection_.reset();
  wire::Envelope request = HelloRequest(options_);
  const Result<std::uint64_t> id = channel_->Send(request, deadline_);
  if (!id) return Error(id.error());
  hello_ = *id;
  extra_ = std::chrono::floor<milliseconds>(deadline_ - Clock::now()) - options_.request_timeout;
  return true;
}

Result<std::optional<AtlasClient>> ConnectAttempt::ShakeHands(Clock::time_point latest) {
  const auto reply = channel_->PollFor(hello_, extra_, latest);
  if (!reply) return Error(reply.error());
  if (!*reply) return std::nullopt;
  if (!(*reply)->has_hello_reply()) return Error(channel_->Unexpected(**reply));
  const wire::HelloReply& hello = (*reply)->hello_reply();
  if (Status status = CheckVersion(hello, options_.endpoint); !status.ok()) {
    return Error(std::move(status));
  }
  const Result<MapProfile> profile = ProfileFromWire(hello.profile());
  if (!profile) return Error(profile.error().WithContext("daemon's handshake"));
  return AtlasClient(std::move(channel_), *profile, IdentityFromWire(hello));
}

ConnectProgress ConnectAttempt::Fail(const Status& status) const {
  ConnectProgress progress;
  progress.failure = status;
  const bool is_refused = channel_ != nullptr && channel_->has_refused(hello_);
  if (channel_ != nullptr) progress.retry_after = channel_->retry_after();
  progress.is_final = status.code() == StatusCode::kUnsupported ||
                      status.code() == StatusCode::kInvalidArgument ||
                      (status.code() == StatusCode::kInvalidData && is_refused);
  return progress;
}

}  // namespace atlas
