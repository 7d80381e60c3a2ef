#include "server/net/request_handler.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "server/net/on_pool.h"
#include "server/net/region_reply.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::milliseconds kDefaultTimeout{60'000};
constexpr std::chrono::milliseconds kLongestTimeout{3'600'000};

std::chrono::milliseconds Timeout(std::uint32_t timeout_ms) {
  const std::chrono::milliseconds asked{timeout_ms};
  return timeout_ms == 0 ? kDefaultTimeout : std::min(asked, kLongestTimeout);
}

bool IsClean(const DirtyState& state, std::uint64_t) {
  return state.dirty_tiles == 0;
}

bool Reflects(const DirtyState& state, std::uint64_t revision) {
  return state.revision >= revision && (state.dirty_tiles == 0 || state.oldest_since > revision);
}

wire::Envelope ReplyTo(const wire::Envelope& request) {
  wire::Envelope reply;
  reply.set_request_id(request.request_id());
  return reply;
}

std::optional<PositionPrior> PriorFromWire(const wire::UploadKeyframe& upload) {
  if (!upload.has_prior()) {
    return std::nullopt;
  }
  const wire::PositionPrior& prior = upload.prior();
  return PositionPrior{prior.x_um(), prior.y_um(), prior.z_um(), prior.radius_mm()};
}

Result<UploadRequest> UploadFromWire(const wire::UploadKeyframe& upload) {
  Result<KeyframeKey> key = KeyFromWire(upload.key());
  if (!key) {
    return Error(key.error());
  }
  Result<QuantizedPose> pose = PoseFromWire(upload.pose());
  if (!pose) {
    return Error(pose.error().WithContext(StrCat("keyframe ", *key)));
  }
  const ByteSpan blob = BytesFromWire(upload.blob());
  return UploadRequest{std::move(*key), upload.time_ms(), *pose, PriorFromWire(upload),
                       Bytes(blob.begin(), blob.end())};
}

Result<PoseUpdateRequest> PosesFromWire(const wire::UpdatePoses& message) {
  PoseUpdateRequest request;
  request.author = message.author();
  request.if_revision = message.if_revision();
  request.updates.reserve(static_cast<std::size_t>(message.updates_size()));
  for (const wire::PoseUpdate& update : message.updates()) {
    Result<KeyframeKey> key = KeyFromWire(update.key());
    if (!key) {
      return Error(key.error());
    }
    Result<QuantizedPose> pose = PoseFromWire(update.pose());
    if (!pose) {
      return Error(pose.error().WithContext(StrCat("keyframe ", *key)));
    }
    request.updates.push_back({std::move(*key), *pose});
  }
  return request;
}

std::string StateName(SessionState state) {
  switch (state) {
    case SessionState::kStaged:
      return "staged";
    case SessionState::kLive:
      return "live";
    case SessionState::kQuarantined:
      return "quarantined";
    case SessionState::kRetracted:
      return "retracted";
  }
  return "unknown";
}

void SessionToWire(const SessionRecord& record, wire::SessionInfo& out) {
  out.set_vehicle(record.key.vehicle);
  out.set_session(record.key.session);
  out.set_state(StateName(record.state));
  out.set_keyframes(record.keyframes);
  out.set_bytes(record.bytes);
  out.set_first_time_ms(record.first_time_ms);
  out.set_last_time_ms(record.last_time_ms);
  out.set_last_sequence(record.last_sequence);
}

Status CheckHello(const wire::Envelope& request, const MapProfile& profile) {
  if (!request.has_hello()) {
    return Status(StatusCode::kInvalidData, "the first frame must be a Hello");
  }
  const wire::Hello& hello = request.hello();
  if (hello.protocol_major() != kProtocolMajor) {
    return Status(StatusCode::kUnsupported,
                  StrCat("protocol version ", hello.protocol_major(), ".", hello.protocol_minor(),
                         ": this daemon speaks ", kProtocolMajor, ".", kProtocolMinor));
  }
  if (!hello.profile().empty()) {
    const Result<MapProfile> expected = ProfileFromWire(hello.profile());
    if (!expected) {
      return expected.error();
    }
    if (*expected != profile) {
      return Status(StatusCode::kInvalidData, "this atlas has another map profile");
    }
  }
  return {};
}

}  // namespace

asio::awaitable<bool> RequestHandler::Greet(Envelope request, ReplyWriter& out) {
  const AtlasIdentity& identity = service_.identity();
  if (Status status = CheckHello(request, identity.profile); !status.ok()) {
    co_await out.SendError(request.request_id(), std::move(status));
    co_return false;
  }
  const Blocking<DirtyState> read = [this] {
    return service_.ReadDirtyState();
  };
  const Result<DirtyState> state = co_await OnPool(pool_, read);
  if (!state) {
    co_await out.SendError(request.request_id(), state.error());
    co_return false;
  }
  Envelope reply = ReplyTo(request);
  wire::HelloReply& hello = *reply.mutable_hello_reply();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_protocol_minor(kProtocolMinor);
  hello.set_profile(ProfileToWire(identity.profile));
  hello.set_atlas_id(BytesToWire(identity.atlas_id));
  hello.set_epoch(identity.epoch);
  hello.set_revision(state->revision);
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
  wire::UploadReply& message = *reply.mutable_upload_reply();
  message.set_duplicate(result->is_duplicate);
  message.set_revision(result->revision);
  message.set_tiles_marked(result->tiles_marked);
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::UpdatePoses(const Envelope& request, ReplyWriter& out) {
  Result<PoseUpdateRequest> update = PosesFromWire(request.update_poses());
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
  wire::UpdatePosesReply& message = *reply.mutable_update_poses_reply();
  message.set_updated(result->updated);
  message.set_tiles_marked(result->tiles_marked);
  message.set_revision(result->revision);
  message.set_batch(result->batch);
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Status> RequestHandler::Query(const Envelope& request, ReplyWriter& out) {
  const wire::QueryRegion& query = request.query_region();
  Result<RegionRequest> region = RegionFromWire(query, service_.identity().profile);
  if (!region) {
    co_return region.error();
  }
  if (query.wait_revision() != 0) {
    const Result<DirtyState> state =
        co_await WaitFor(&Reflects, query.wait_revision(), Timeout(query.timeout_ms()));
    if (!state) {
      co_return state.error();
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
  wire::StatusReply& message = *reply.mutable_status_reply();
  const StoreCounts& counts = status->counts;
  message.set_revision(counts.revision);
  message.set_keyframes(counts.keyframes);
  message.set_sessions(counts.sessions);
  message.set_tiles(counts.tiles);
  message.set_dirty_tiles(counts.dirty_tiles);
  message.set_store_bytes(counts.store_bytes);
  message.set_tile_bytes(counts.tile_bytes);
  message.set_keyframe_bytes(counts.keyframe_bytes);
  message.set_cells(counts.cells);
  message.set_multilayer_cells(counts.multilayer_cells);
  message.set_rss_bytes(status->rss_bytes);
  co_await out.Send(std::move(reply));
  co_return Status();
}

asio::awaitable<Result<DirtyState>> RequestHandler::WaitFor(DirtyPredicate is_done,
                                                            std::uint64_t revision,
                                                            std::chrono::milliseconds timeout) {
  constexpr std::chrono::milliseconds kFirstPause{5};
  constexpr std::chrono::milliseconds kLongestPause{200};
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  asio::steady_timer timer(co_await asio::this_coro::executor);
  std::chrono::milliseconds pause = kFirstPause;
  const Blocking<DirtyState> read = [this] {
    return service_.ReadDirtyState();
  };
  while (true) {
    Result<DirtyState> state = co_await OnPool(pool_, read);
    if (!state || is_done(*state, revision)) {
      co_return state;
    }
    if (std::chrono::steady_clock::now() >= deadline) {
      co_return Error(StatusCode::kTimeout,
                      StrCat(state->dirty_tiles, " tiles are still to be fused after ",
                             timeout.count(), " ms"));
    }
    timer.expires_after(pause);
    co_await timer.async_wait(asio::use_awaitable);
    pause = std::min(2 * pause, kLongestPause);
  }
}

asio::awaitable<Status> RequestHandler::Wait(const Envelope& request, ReplyWriter& out) {
  const Result<DirtyState> state =
      co_await WaitFor(&IsClean, 0, Timeout(request.wait_request().timeout_ms()));
  if (!state) {
    co_return state.error();
  }
  Envelope reply = ReplyTo(request);
  reply.mutable_wait_reply()->set_revision(state->revision);
  reply.mutable_wait_reply()->set_dirty_tiles(state->dirty_tiles);
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
  const Blocking<DigestResult> compute = [this] {
    return service_.Digest();
  };
  const auto timeout = Timeout(request.digest_request().timeout_ms());
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const Result<DirtyState> state = co_await WaitFor(&IsClean, 0, timeout);
    if (!state) {
      co_return state.error();
    }
    const Result<DigestResult> digest = co_await OnPool(pool_, compute);
    if (!digest) {
      const bool changed_meanwhile = digest.error().code() == StatusCode::kConflict;
      if (changed_meanwhile && std::chrono::steady_clock::now() < deadline) {
        continue;
      }
      co_return digest.error();
    }
    Envelope reply = ReplyTo(request);
    reply.mutable_digest_reply()->set_sha256(BytesToWire(digest->sha256));
    reply.mutable_digest_reply()->set_tiles(digest->tiles);
    reply.mutable_digest_reply()->set_revision(digest->revision);
    co_await out.Send(std::move(reply));
    co_return Status();
  }
}

asio::awaitable<Status> RequestHandler::Verify(const Envelope& request, ReplyWriter& out) {
  const wire::VerifyRequest& verify = request.verify_request();
  const Result<DirtyState> state = co_await WaitFor(&IsClean, 0, Timeout(verify.timeout_ms()));
  if (!state) {
    co_return state.error();
  }
  const bool is_rebuild = verify.rebuild();
  const Blocking<VerifyResult> check = [this, is_rebuild] {
    return service_.Verify(is_rebuild);
  };
  const Result<VerifyResult> result = co_await OnPool(pool_, check);
  if (!result) {
    co_return result.error();
  }
  Envelope reply = ReplyTo(request);
  wire::VerifyReply& message = *reply.mutable_verify_reply();
  message.set_checked(result->checked);
  message.set_damaged(result->damaged);
  message.set_mismatched(result->mismatched);
  message.set_revision(result->revision);
  for (const std::string& finding : result->findings) {
    message.add_findings(finding);
  }
  co_await out.Send(std::move(reply));
  co_return Status();
}

}  // namespace atlas
