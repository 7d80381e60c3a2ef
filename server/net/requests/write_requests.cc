#include "server/net/requests/write_requests.h"

#include <functional>
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

template <typename Request>
using Reading = std::function<Result<Request>()>;

// Reads a request on the pool and hands it to the service there; its answer, once it is on disk or
// refused.
template <typename Request, typename T>
asio::awaitable<Result<T>> Write(RequestContext& context,
                                 Reading<Request> read,
                                 Writing<Request, T> write) {
  Starting<T> start = [&context, read = std::move(read), write](auto done) {
    Result<Request> request = read();
    if (!request) {
      done(Error(request.error()));
      return;
    }
    (context.service.*write)(*std::move(request), std::move(done));
  };
  co_return co_await StartOnPool(context.pool, std::move(start));
}

asio::awaitable<Result<NewKeyframe>> CheckUpload(RequestContext& context,
                                                 const wire::UploadKeyframe& message) {
  const Blocking<NewKeyframe> check = [&context, &message]() -> Result<NewKeyframe> {
    Result<UploadRequest> upload = UploadFromWire(message);
    if (!upload) {
      return Error(upload.error());
    }
    return context.service.CheckUpload(*std::move(upload));
  };
  co_return co_await OnPool(context.pool, check);
}

}  // namespace

void NoteRefusedUpload(const wire::UploadKeyframe& message, const Status& why, Peer& peer) {
  if (const Result<KeyframeKey> key = KeyFromWire(message.key())) {
    peer.missing->NoteEnd(*key, why);
  }
}

asio::awaitable<Status> AnswerUpload(RequestContext& context,
                                     const wire::Envelope& request,
                                     Peer& peer) {
  TurnOrder::Turn turn(peer.uploads);
  Result<NewKeyframe> keyframe = co_await CheckUpload(context, request.upload_keyframe());
  co_await turn.Come();
  if (!keyframe) {
    NoteRefusedUpload(request.upload_keyframe(), keyframe.error(), peer);
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
  if (!result) {
    co_return result.error();
  }
  wire::Envelope reply = ReplyTo(request);
  UploadToWire(*result, *reply.mutable_upload_reply());
  co_await peer.out.SendWithOthers(std::move(reply));  // uploads are committed in groups
  co_return Status();
}

asio::awaitable<Status> AnswerUpdatePoses(RequestContext& context,
                                          const Request& request,
                                          ReplyWriter& out) {
  const wire::Envelope& message = *request.message;
  const auto poses = request.poses;
  const Reading<PoseBatchRequest> read = [&message, poses, &known = out.peer().name] {
    auto batch = poses ? std::move(*poses) : PosesFromWire(message.update_poses());
    if (batch) {
      batch->author = AuthorOf(known, std::move(batch->author));
    }
    return batch;
  };
  const auto result = co_await Write(context, read, &AtlasService::UpdatePoses);
  co_return co_await Answer(message, result, &wire::Envelope::mutable_update_poses_reply,
                            PosesToWire, out);
}

asio::awaitable<Status> AnswerUndoPoses(RequestContext& context,
                                        const wire::Envelope& request,
                                        ReplyWriter& out) {
  const Reading<PoseUndoRequest> read = [&request, &known = out.peer().name] {
    const wire::UndoPoses& message = request.undo_poses();
    return Result<PoseUndoRequest>({message.batch(), AuthorOf(known, message.author())});
  };
  const auto result = co_await Write(context, read, &AtlasService::UndoPoses);
  co_return co_await Answer(request, result, &wire::Envelope::mutable_update_poses_reply,
                            PosesToWire, out);
}

asio::awaitable<Status> AnswerChangeSession(RequestContext& context,
                                            const wire::Envelope& request,
                                            ReplyWriter& out) {
  const Reading<SessionChange> read = [&request, &known = out.peer().name] {
    auto change = SessionChangeFromWire(request.change_session());
    if (change) {
      change->author = AuthorOf(known, std::move(change->author));
    }
    return change;
  };
  const auto result = co_await Write(context, read, &AtlasService::ChangeSession);
  co_return co_await Answer(request, result, &wire::Envelope::mutable_change_session_reply,
                            SessionChangeToWire, out);
}

}  // namespace atlas
