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
#include "server/net/requests/watch_reply.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

constexpr std::size_t kBytesAtOnce = 1u << 20;  // of a reply, then it is the others' turn

}  // namespace

std::optional<asio::awaitable<void>> RequestHandler::Greet(Envelope request,
                                                           const Identity& identity,
                                                           ReplyWriter& out) {
  RequestRecord record(out.peer(), request);
  const StoreIdentity& atlas = service_.identity();
  Envelope reply = ReplyTo(request);
  wire::HelloReply& hello = *reply.mutable_hello_reply();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_protocol_minor(kProtocolMinor);
  hello.set_profile(ProfileToWire(atlas.profile));
  hello.set_atlas_id(BytesToWire(atlas.atlas_id));
  hello.set_epoch(atlas.epoch);
  hello.set_revision(service_.revision());
  hello.set_max_frame_bytes(options_.max_frame_bytes);
  hello.set_name(identity.name);
  hello.set_role(std::string(RoleName(identity.role)));
  if (!request.hello().has_resume()) {
    out.Push(reply);
    record.End({});
    return std::nullopt;
  }
  const wire::Hello::Session& session = request.hello().resume();
  return Resume({session.vehicle(), session.session()}, std::move(reply), std::move(record), out);
}

asio::awaitable<void> RequestHandler::Resume(SessionKey session,
                                             Envelope reply,
                                             RequestRecord record,
                                             ReplyWriter& out) {
  const Blocking<std::optional<SessionRecord>> find = [this, session] {
    return service_.FindSession(session);
  };
  const Result<std::optional<SessionRecord>> found = co_await OnPool(pool_, find);
  record.End(found ? Status() : found.error());
  if (!found) {
    co_await out.SendError(reply.request_id(), found.error());
    co_return;
  }
  if (*found) {
    reply.mutable_hello_reply()->set_last_sequence((*found)->last_sequence);
  }
  co_await out.Send(std::move(reply));
}

std::optional<asio::awaitable<void>> RequestHandler::Handle(Envelope request, Peer& peer) {
  if (request.has_cancel_request()) {
    Cancel(request, peer);
    return std::nullopt;
  }
  if (request.has_watch_request()) {
    return Watch(std::move(request), peer);
  }
  if (request.has_upload_keyframe()) {
    return Upload(std::move(request), peer);
  }
  if (!request.has_sync_request()) {
    return Await(std::move(request), peer.out);
  }
  RequestRecord record(peer.out.peer(), request);
  auto reply = std::make_shared<SyncReply>(service_, frames_, std::move(request));
  const bool may_begin = reply->message().wait_revision() == 0;
  if (may_begin && SyncAtOnce(*reply, record, peer.out)) {
    return std::nullopt;
  }
  return Sync(std::move(reply), std::move(record), peer.out);
}

void RequestHandler::Cancel(const Envelope& request, Peer& peer) {
  RequestRecord record(peer.out.peer(), request);
  Envelope reply = ReplyTo(request);
  const bool is_cancelled = peer.Cancel(request.cancel_request().request_id());
  reply.mutable_cancel_reply()->set_cancelled(is_cancelled);
  peer.out.Push(reply);
  record.End({});
}

asio::awaitable<void> RequestHandler::Watch(Envelope request, Peer& peer) {
  RequestRecord record(peer.out.peer(), request);
  const std::uint64_t id = request.request_id();
  const Places::Place place = watch_places_.Take();
  Status status;
  if (place == nullptr) {
    status = {StatusCode::kUnavailable, StrCat(watch_places_.max_places(),
                                               " watches are under way already; try again later")};
  } else if (!peer.Begin(id)) {
    status = {StatusCode::kInvalidArgument,
              StrCat("watch ", id, ": there is one under this id, or there are ",
                     Peer::kMaxCancellable, " on this connection")};
  } else {
    status = co_await SendWatch(service_, request, peer.cancelled(id), peer.out);
    peer.End(id);
    const bool is_over = status.code() == StatusCode::kUnavailable;  // as every watch once is
    record.End(is_over ? Status() : status);
  }
  record.End(status);
  co_await peer.out.SendError(id, std::move(status));
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

asio::awaitable<void> RequestHandler::Upload(Envelope request, Peer& peer) {
  RequestRecord record(peer.out.peer(), request);
  Status status = co_await PutInOrder(request, peer);
  record.End(status);
  if (!status.ok()) {
    co_await peer.out.SendError(request.request_id(), std::move(status));
  }
}

asio::awaitable<Status> RequestHandler::PutInOrder(const Envelope& request, Peer& peer) {
  UploadOrder::Turn turn(peer.uploads);
  Result<UploadRequest> upload = UploadFromWire(request.upload_keyframe());
  if (!upload) {
    co_return upload.error();
  }
  const auto unchecked = std::make_shared<UploadRequest>(*std::move(upload));
  const Blocking<NewKeyframe> check = [this, unchecked] {
    return service_.CheckUpload(std::move(*unchecked));
  };
  Result<NewKeyframe> keyframe = co_await OnPool(pool_, check);
  if (!keyframe) {
    co_return keyframe.error();
  }
  co_await turn.Come();
  const auto executor = co_await asio::this_coro::executor;
  const auto put = std::make_shared<OneShot<PutKeyframeResult>>(executor);
  const auto done = [put](Result<PutKeyframeResult> result) {
    put->Set(std::move(result));
  };
  service_.PutKeyframe(*std::move(keyframe), done);
  turn.Leave();
  const Result<PutKeyframeResult> result = co_await put->Take();
  if (!result) {
    co_return result.error();
  }
  Envelope reply = ReplyTo(request);
  UploadToWire(*result, *reply.mutable_upload_reply());
  co_await peer.out.Send(std::move(reply));
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
