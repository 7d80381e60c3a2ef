#include "server/net/requests/write_requests.h"

#include <memory>
#include <utility>

#include "proto/wire/convert.h"
#include "server/net/requests/answer.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/request_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

template <typename Request, typename T>
using Writing = void (AtlasService::*)(Request, AtlasStore::Done<T>);

// Hands a write to the service on the pool; its answer, once it is on disk or refused.
template <typename Request, typename T>
asio::awaitable<Result<T>> Write(RequestContext& context,
                                 Result<Request> request,
                                 Writing<Request, T> write) {
  if (!request) {
    co_return Error(request.error());
  }
  const auto owned = std::make_shared<Request>(*std::move(request));
  Starting<T> start = [&context, owned, write](auto done) {
    (context.service.*write)(std::move(*owned), std::move(done));
  };
  co_return co_await StartOnPool(context.pool, std::move(start));
}

asio::awaitable<Result<NewKeyframe>> CheckUpload(RequestContext& context,
                                                 const wire::UploadKeyframe& message) {
  Result<UploadRequest> upload = UploadFromWire(message);
  if (!upload) {
    co_return Error(upload.error());
  }
  const auto unchecked = std::make_shared<UploadRequest>(*std::move(upload));
  const Blocking<NewKeyframe> check = [&context, unchecked] {
    return context.service.CheckUpload(std::move(*unchecked));
  };
  co_return co_await OnPool(context.pool, check);
}

void NoteRefusal(const wire::UploadKeyframe& message, const Status& why, MissingUploads& missing) {
  if (const Result<KeyframeKey> key = KeyFromWire(message.key())) {
    missing.NoteEnd(*key, why);
  }
}

}  // namespace

asio::awaitable<Status> AnswerUpload(RequestContext& context,
                                     const wire::Envelope& request,
                                     Peer& peer) {
  UploadOrder::Turn turn(peer.uploads);
  Result<NewKeyframe> keyframe = co_await CheckUpload(context, request.upload_keyframe());
  co_await turn.Come();
  if (!keyframe) {
    NoteRefusal(request.upload_keyframe(), keyframe.error(), *peer.missing);
    co_return keyframe.error();
  }
  keyframe->missing = peer.missing;
  const auto executor = co_await asio::this_coro::executor;
  const auto put = std::make_shared<OneShot<PutKeyframeResult>>(executor);
  const auto done = [put](Result<PutKeyframeResult> result) {
    put->Set(std::move(result));
  };
  context.service.PutKeyframe(*std::move(keyframe), done);
  turn.Leave();
  const Result<PutKeyframeResult> result = co_await put->Take();
  co_return co_await Answer(request, result, &wire::Envelope::mutable_upload_reply, UploadToWire,
                            peer.out);
}

asio::awaitable<Status> AnswerUpdatePoses(RequestContext& context,
                                          const wire::Envelope& request,
                                          ReplyWriter& out) {
  Result<PoseBatchRequest> update = PosesFromWire(request.update_poses());
  const auto result = co_await Write(context, std::move(update), &AtlasService::UpdatePoses);
  co_return co_await Answer(request, result, &wire::Envelope::mutable_update_poses_reply,
                            PosesToWire, out);
}

asio::awaitable<Status> AnswerChangeSession(RequestContext& context,
                                            const wire::Envelope& request,
                                            ReplyWriter& out) {
  Result<SessionChange> change = SessionChangeFromWire(request.change_session());
  const auto result = co_await Write(context, std::move(change), &AtlasService::ChangeSession);
  co_return co_await Answer(request, result, &wire::Envelope::mutable_change_session_reply,
                            SessionChangeToWire, out);
}

}  // namespace atlas
