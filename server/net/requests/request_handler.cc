#include "server/net/requests/request_handler.h"

#include <memory>
#include <utility>
#include <vector>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "server/net/requests/atlas_wait.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/region_reply.h"
#include "server/net/requests/request_conversion.h"
#include "server/net/requests/sync_reply.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

constexpr std::size_t kBytesAtOnce = 1u << 20;  // of a reply, then it is the others' turn

}  // namespace

bool RequestHandler::Greet(const Envelope& request, ReplyWriter& out) const {
  const AtlasIdentity& identity = service_.identity();
  RequestRecord record(out.peer(), request);
  if (const Status status = CheckHello(request, identity.profile); !status.ok()) {
    record.End(status);
    out.PushError(request.request_id(), status);
    return false;
  }
  Envelope reply = ReplyTo(request);
  wire::HelloReply& hello = *reply.mutable_hello_reply();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_protocol_minor(kProtocolMinor);
  hello.set_profile(ProfileToWire(identity.profile));
  hello.set_atlas_id(BytesToWire(identity.atlas_id));
  hello.set_epoch(identity.epoch);
  hello.set_revision(service_.revision());
  hello.set_max_frame_bytes(options_.max_frame_bytes);
  out.Push(reply);
  record.End({});
  return true;
}

std::optional<asio::awaitable<void>> RequestHandler::Handle(Envelope request, ReplyWriter& out) {
  if (!request.has_sync_request()) {
    return Await(std::move(request), out);
  }
  RequestRecord record(out.peer(), request);
  auto reply = std::make_shared<SyncReply>(service_, frames_, std::move(request));
  const bool may_begin = reply->message().wait_revision() == 0;
  if (may_begin && SyncAtOnce(*reply, record, out)) {
    return std::nullopt;
  }
  return Sync(std::move(reply), std::move(record), out);
}

asio::awaitable<void> RequestHandler::Await(Envelope request, ReplyWriter& out) {
  RequestRecord record(out.peer(), request);
  Status status = co_await Dispatch(request, out);
  record.End(status);
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
    case Envelope::kChangeSession:
      return ChangeSession(request, out);
    case Envelope::kQueryRegion:
      return request.query_region().has_at_revision() ? QueryThePast(request, out)
                                                      : Query(request, out);
    case Envelope::kStatusRequest:
      return ReadStatus(request, out);
    case Envelope::kWaitRequest:
      return Wait(request, out);
    case Envelope::kSessionsRequest:
      return ListSessions(request, out);
    case Envelope::kDigestRequest:
      return request.digest_request().has_at_revision() ? DigestThePast(request, out)
                                                        : Digest(request, out);
    case Envelope::kVerifyRequest:
      return Verify(request, out);
    case Envelope::kCompactRequest:
      return Compact(request, out);
    default:
      return Refuse(request);
  }
}

asio::awaitable<Status> RequestHandler::Refuse(const Envelope& request) {
  if (request.has_hello()) {
    co_return Status(StatusCode::kInvalidArgument,
                     StrCat("request ", request.request_id(),
                            ": this connection has been greeted already, a Hello comes once"));
  }
  co_return Status(StatusCode::kUnsupported, StrCat("request ", request.request_id(),
                                                    ": this daemon does not know its body (",
                                                    static_cast<int>(request.body_case()), ")"));
}

// Hands a write to the service on the pool; its answer, once it is on disk or refused.
template <typename Request, typename T>
asio::awaitable<Result<T>> RequestHandler::Write(Request request, Writing<Request, T> write) {
  const auto owned = std::make_shared<Request>(std::move(request));
  Starting<T> start = [this, owned, write](auto done) {
    (service_.*write)(std::move(*owned), std::move(done));
  };
  co_return co_await StartOnPool(pool_, std::move(start));
}

asio::awaitable<Status> RequestHandler::Upload(const Envelope& request, ReplyWriter& out) {
  Result<UploadRequest> upload = UploadFromWire(request.upload_keyframe());
  if (!upload) {
    co_return upload.error();
  }
  const auto result = co_await Write(*std::move(upload), &AtlasService::Upload);
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
  const auto result = co_await Write(*std::move(update), &AtlasService::UpdatePoses);
  if (!result) {
    co_return result.error();
  }
  Envelope reply = ReplyTo(request);
  PosesToWire(*result, *reply.mutable_update_poses_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::ChangeSession(const Envelope& request, ReplyWriter& out) {
  Result<SessionChange> change = SessionChangeFromWire(request.change_session());
  if (!change) {
    co_return change.error();
  }
  const auto result = co_await Write(*std::move(change), &AtlasService::ChangeSession);
  if (!result) {
    co_return result.error();
  }
  Envelope reply = ReplyTo(request);
  SessionChangeToWire(*result, *reply.mutable_change_session_reply());
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
    const Result<Places::Place> place = places_.Take();
    if (!place) {
      co_return place.error();
    }
    const Patience patience{TimeoutFromWire(query.timeout_ms()), out.peer_left()};
    Status status = co_await WaitForRevision(service_, pool_, query.wait_revision(), patience);
    if (!status.ok()) {
      co_return status;
    }
  }
  co_return co_await SendRegion(service_, pool_, request, *region, out);
}

// Fusing is long work: it has places and threads of its own, and ends when the peer leaves.
asio::awaitable<Status> RequestHandler::QueryThePast(const Envelope& request, ReplyWriter& out) {
  const Result<RegionRequest> region = RegionFromWire(request.query_region());
  if (!region) {
    co_return region.error();
  }
  const Result<Places::Place> place = places_.Take();
  if (!place) {
    co_return place.error();
  }
  co_return co_await SendRegion(service_, reading_pool_, request, *region, out);
}

bool RequestHandler::SyncAtOnce(SyncReply& reply, RequestRecord& record, ReplyWriter& out) {
  std::vector<ReplyFrame> frames;
  for (std::size_t bytes = 0; out.has_room() && bytes < kBytesAtOnce;) {
    const Result<SyncReply::Step> step = reply.Next(false, frames);
    if (!step) {
      out.PushError(reply.request_id(), step.error());
      record.End(step.error());
      return true;
    }
    for (const ReplyFrame& frame : frames) {
      out.Push(frame);
      bytes += frame.size();
    }
    frames.clear();
    if (*step == SyncReply::Step::kDone) {
      record.End({});
      return true;
    }
    if (*step == SyncReply::Step::kBlocked) {
      return false;
    }
  }
  return false;
}

asio::awaitable<void> RequestHandler::Sync(std::shared_ptr<SyncReply> reply,
                                           RequestRecord record,
                                           ReplyWriter& out) {
  Status status = co_await WaitAndSync(reply, out);
  record.End(status);
  if (!status.ok()) {
    co_await out.SendError(reply->request_id(), std::move(status));
  }
}

asio::awaitable<Status> RequestHandler::WaitAndSync(std::shared_ptr<SyncReply> reply,
                                                    ReplyWriter& out) {
  const wire::SyncRequest& message = reply->message();
  if (message.wait_revision() != 0) {
    const Result<Places::Place> place = places_.Take();
    if (!place) {
      co_return place.error();
    }
    const Patience patience{TimeoutFromWire(message.timeout_ms()), out.peer_left()};
    Status status = co_await WaitForRevision(service_, pool_, message.wait_revision(), patience);
    if (!status.ok()) {
      co_return status;
    }
  }
  co_return co_await SendSync(std::move(reply), pool_, out);
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
  const Result<Places::Place> place = places_.Take();
  if (!place) {
    co_return place.error();
  }
  const Patience patience{TimeoutFromWire(request.wait_request().timeout_ms()), out.peer_left()};
  const Result<WaitOutcome> outcome = co_await WaitUntilClean(service_, pool_, patience);
  if (!outcome) {
    co_return outcome.error();
  }
  if (!outcome->damage.ok()) {
    co_return outcome->damage;
  }
  Envelope reply = ReplyTo(request);
  WaitToWire(*outcome, *reply.mutable_wait_reply());
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
  const Result<Places::Place> place = places_.Take();
  if (!place) {
    co_return place.error();
  }
  const Patience patience{TimeoutFromWire(request.digest_request().timeout_ms()), out.peer_left()};
  const Result<WaitOutcome> settled = co_await RequireSettled(service_, pool_, patience);
  if (!settled) {
    co_return settled.error();
  }
  if (!settled->damage.ok()) {
    co_return settled->damage;
  }
  const Blocking<AtlasDigest> compute = [this, patience] {
    return service_.Digest(patience);
  };
  const Result<AtlasDigest> digest = co_await OnPool(reading_pool_, compute);
  if (!digest) {
    co_return digest.error();
  }
  Envelope reply = ReplyTo(request);
  DigestToWire(*digest, *reply.mutable_digest_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::DigestThePast(const Envelope& request, ReplyWriter& out) {
  const Result<Places::Place> place = places_.Take();
  if (!place) {
    co_return place.error();
  }
  const std::uint64_t revision = request.digest_request().at_revision();
  const Patience patience{TimeoutFromWire(request.digest_request().timeout_ms()), out.peer_left()};
  const Blocking<AtlasDigest> compute = [this, revision, patience] {
    return service_.DigestAt(revision, patience);
  };
  const Result<AtlasDigest> digest = co_await OnPool(reading_pool_, compute);
  if (!digest) {
    co_return digest.error();
  }
  Envelope reply = ReplyTo(request);
  DigestToWire(*digest, *reply.mutable_digest_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::Verify(const Envelope& request, ReplyWriter& out) {
  const Result<Places::Place> place = places_.Take();
  if (!place) {
    co_return place.error();
  }
  const bool is_rebuild = request.verify_request().rebuild();
  const Patience patience{TimeoutFromWire(request.verify_request().timeout_ms()), out.peer_left()};
  if (is_rebuild) {
    const Result<WaitOutcome> settled = co_await RequireSettled(service_, pool_, patience);
    if (!settled) {
      co_return settled.error();
    }
  }
  const Blocking<VerifyReport> check = [this, is_rebuild, patience] {
    return service_.Verify(is_rebuild, patience);
  };
  const Result<VerifyReport> result = co_await OnPool(reading_pool_, check);
  if (!result) {
    co_return result.error();
  }
  Envelope reply = ReplyTo(request);
  VerifyToWire(*result, *reply.mutable_verify_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

// The wait for the workers takes no thread; what is refused is refused before it.
asio::awaitable<Status> RequestHandler::Compact(const Envelope& request, ReplyWriter& out) {
  const CompactionRequest compaction = CompactionFromWire(request.compact_request());
  Status status = CheckCompaction(compaction, service_.identity().profile);
  if (!status.ok()) {
    co_return status;
  }
  const Result<Places::Place> place = places_.Take();
  if (!place) {
    co_return place.error();
  }
  const Patience patience{TimeoutFromWire(request.compact_request().timeout_ms()), out.peer_left()};
  const Result<WaitOutcome> settled = co_await RequireSettled(service_, pool_, patience);
  if (!settled) {
    co_return settled.error();
  }
  const Blocking<CompactionReport> compact = [this, compaction, patience] {
    return service_.Compact(compaction, patience);
  };
  const Result<CompactionReport> report = co_await OnPool(reading_pool_, compact);
  if (!report) {
    co_return report.error();
  }
  Envelope reply = ReplyTo(request);
  CompactionToWire(*report, *reply.mutable_compact_reply());
  co_await out.Send(std::move(reply));
  co_return Status();
}

}  // namespace atlas
