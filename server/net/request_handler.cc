#include "server/net/request_handler.h"

#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "server/net/atlas_wait.h"
#include "server/net/on_pool.h"
#include "server/net/region_reply.h"
#include "server/net/request_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

}  // namespace

asio::awaitable<bool> RequestHandler::Greet(Envelope request, ReplyWriter& out) {
  const AtlasIdentity& identity = service_.identity();
  if (Status status = CheckHello(request, identity.profile); !status.ok()) {
    co_await out.SendError(request.request_id(), std::move(status));
    co_return false;
  }
  const Blocking<std::uint64_t> read = [this] {
    return service_.ReadRevision();
  };
  const Result<std::uint64_t> revision = co_await OnPool(pool_, read);
  if (!revision) {
    co_await out.SendError(request.request_id(), revision.error());
    co_return false;
  }
  Envelope reply = ReplyTo(request);
  wire::HelloReply& hello = *reply.mutable_hello_reply();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_protocol_minor(kProtocolMinor);
  hello.set_profile(ProfileToWire(identity.profile));
  hello.set_atlas_id(BytesToWire(identity.atlas_id));
  hello.set_epoch(identity.epoch);
  hello.set_revision(*revision);
  hello.set_max_frame_bytes(options_.max_frame_bytes);
  co_return co_await out.Send(std::move(reply));
}

asio::awaitable<void> RequestHandler::Handle(Envelope request, ReplyWriter& out) {
  Status status = co_await Dispatch(request, out);
  if (!status.ok()) {
    co_await out.SendError(request.request_id(), std::move(status));
  }
}

asio::awaitable<Status> RequestHandler::Dispatch(const Envelope& request, ReplyWriter& out) {
  switch (request.body_case()) {
    case Envelope::kUploadKeyframe:
      return Upload(request, out);
    case Envelope::kUpdatePoses:
      return UpdatePoses(request, out);
    case Envelope::kQueryRegion:
      return Query(request, out);
    case Envelope::kStatusRequest:
      return ReadStatus(request, out);
    case Envelope::kWaitRequest:
      return Wait(request, out);
    case Envelope::kSessionsRequest:
      return ListSessions(request, out);
    case Envelope::kDigestRequest:
      return Digest(request, out);
    case Envelope::kVerifyRequest:
      return Verify(request, out);
    default:
      return Refuse(request);
  }
}

asio::awaitable<Status> RequestHandler::Refuse(const Envelope& request) {
  co_return Status(StatusCode::kUnsupported, StrCat("request ", request.request_id(),
                                                    ": this daemon does not know its body (",
                                                    static_cast<int>(request.body_case()), ")"));
}

asio::awaitable<Status> RequestHandler::Upload(const Envelope& request, ReplyWriter& out) {
  Result<UploadRequest> upload = UploadFromWire(request.upload_keyframe());
  if (!upload) {
    co_return upload.error();
  }
  const auto done =
      std::make_shared<OneShot<PutKeyframeResult>>(co_await asio::this_coro::executor);
  asio::post(pool_, [this, done, upload = std::move(*upload)]() mutable {
    service_.Upload(std::move(upload),
                    [done](Result<PutKeyframeResult> result) { done->Set(std::move(result)); });
  });
  const Result<PutKeyframeResult> result = co_await done->Take();
  if (!result) {
    co_return result.error();
  }
  Envelope reply = ReplyTo(request);
  UploadToWire(*result, *reply.mutable_upload_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::UpdatePoses(const Envelope& request, ReplyWriter& out) {
  Result<PoseBatchRequest> update = PosesFromWire(request.update_poses());
  if (!update) {
    co_return update.error();
  }
  const auto done = std::make_shared<OneShot<PoseBatchResult>>(co_await asio::this_coro::executor);
  asio::post(pool_, [this, done, update = std::move(*update)]() mutable {
    service_.UpdatePoses(std::move(update),
                         [done](Result<PoseBatchResult> result) { done->Set(std::move(result)); });
  });
  const Result<PoseBatchResult> result = co_await done->Take();
  if (!result) {
    co_return result.error();
  }
  Envelope reply = ReplyTo(request);
  PosesToWire(*result, *reply.mutable_update_poses_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::Query(const Envelope& request, ReplyWriter& out) {
  const wire::QueryRegion& query = request.query_region();
  Result<RegionRequest> region = RegionFromWire(query);
  if (!region) {
    co_return region.error();
  }
  if (query.wait_revision() != 0) {
    Status status = co_await WaitForRevision(service_, pool_, query.wait_revision(),
                                             TimeoutFromWire(query.timeout_ms()));
    if (!status.ok()) {
      co_return status;
    }
  }
  co_return co_await SendRegion(service_, pool_, request, std::move(*region), out);
}

asio::awaitable<Status> RequestHandler::ReadStatus(const Envelope& request, ReplyWriter& out) {
  const Blocking<ServiceStatus> read = [this] {
    return service_.ReadStatus();
  };
  const Result<ServiceStatus> status = co_await OnPool(pool_, read);
  if (!status) {
    co_return status.error();
  }
  Envelope reply = ReplyTo(request);
  StatusToWire(*status, *reply.mutable_status_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::Wait(const Envelope& request, ReplyWriter& out) {
  const Result<WaitOutcome> outcome = co_await WaitUntilClean(
      service_, pool_, TimeoutFromWire(request.wait_request().timeout_ms()));
  if (!outcome) {
    co_return outcome.error();
  }
  Envelope reply = ReplyTo(request);
  reply.mutable_wait_reply()->set_revision(outcome->revision);
  reply.mutable_wait_reply()->set_dirty_tiles(outcome->dirty_tiles);
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::ListSessions(const Envelope& request, ReplyWriter& out) {
  const Blocking<std::vector<SessionRecord>> list = [this] {
    return service_.ListSessions();
  };
  const Result<std::vector<SessionRecord>> sessions = co_await OnPool(pool_, list);
  if (!sessions) {
    co_return sessions.error();
  }
  Envelope reply = ReplyTo(request);
  wire::SessionsReply& message = *reply.mutable_sessions_reply();
  for (const SessionRecord& record : *sessions) {
    SessionToWire(record, *message.add_sessions());
  }
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::Digest(const Envelope& request, ReplyWriter& out) {
  const std::chrono::milliseconds timeout = TimeoutFromWire(request.digest_request().timeout_ms());
  const Result<WaitOutcome> clean = co_await WaitUntilClean(service_, pool_, timeout);
  if (!clean) {
    co_return clean.error();
  }
  const Blocking<AtlasDigest> compute = [this, timeout] {
    return service_.Digest(Patience{timeout, {}});
  };
  const Result<AtlasDigest> digest = co_await OnPool(pool_, compute);
  if (!digest) {
    co_return digest.error();
  }
  Envelope reply = ReplyTo(request);
  DigestToWire(*digest, *reply.mutable_digest_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::Verify(const Envelope& request, ReplyWriter& out) {
  const bool is_rebuild = request.verify_request().rebuild();
  const std::chrono::milliseconds timeout = TimeoutFromWire(request.verify_request().timeout_ms());
  if (is_rebuild) {
    const Result<WaitOutcome> clean = co_await WaitUntilClean(service_, pool_, timeout);
    if (!clean) {
      co_return clean.error();
    }
  }
  const Blocking<VerifyReport> check = [this, is_rebuild, timeout] {
    return service_.Verify(is_rebuild, Patience{timeout, {}});
  };
  const Result<VerifyReport> result = co_await OnPool(pool_, check);
  if (!result) {
    co_return result.error();
  }
  Envelope reply = ReplyTo(request);
  VerifyToWire(*result, *reply.mutable_verify_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

}  // namespace atlas
