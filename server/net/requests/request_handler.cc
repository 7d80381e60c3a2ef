#include "server/net/requests/request_handler.h"

#include <memory>
#include <utility>
#include <vector>

#include <boost/asio/post.hpp>

#include "core/base/str_cat.h"
#include "proto/wire/convert.h"
#include "server/net/requests/backup_requests.h"
#include "server/net/requests/keyframes_reply.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/read_keyframes_reply.h"
#include "server/net/requests/read_requests.h"
#include "server/net/requests/request_conversion.h"
#include "server/net/requests/sessions_reply.h"
#include "server/net/requests/whole_atlas_requests.h"
#include "server/net/requests/write_requests.h"
#include "server/service/process_memory.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

constexpr std::size_t kBytesAtOnce = 1u << 20;  // of a reply, then it is the others' turn

void EndSync(const SyncReply& reply, const Status& status, RequestRecord& record) {
  if (reply.is_cut_late()) {
    record.NoteLate();
  }
  record.End(status);
}

}  // namespace

std::optional<asio::awaitable<void>> RequestHandler::Greet(Envelope request,
                                                           const Identity& identity,
                                                           ReplyWriter& out) {
  RequestRecord record(out.peer(), request);
  const StoreIdentity& atlas = context_.service.identity();
  Envelope reply = ReplyTo(request);
  wire::HelloReply& hello = *reply.mutable_hello_reply();
  hello.set_protocol_major(kProtocolMajor);
  hello.set_protocol_minor(kProtocolMinor);
  hello.set_profile(ProfileToWire(atlas.profile));
  hello.set_atlas_id(BytesToWire(atlas.atlas_id));
  hello.set_epoch(atlas.epoch);
  hello.set_revision(context_.service.revision());
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
    return context_.service.FindSession(session);
  };
  const Result<std::optional<SessionRecord>> found = co_await OnPool(context_.pool, find);
  record.End(found ? Status() : found.error());
  if (!found) {
    co_await out.SendError(reply.request_id(), found.error());
    co_return;
  }
  if (*found && (*found)->state != SessionState::kPurged) {
    reply.mutable_hello_reply()->set_last_sequence((*found)->last_sequence);
  }
  co_await out.Send(std::move(reply));
}

std::optional<asio::awaitable<void>> RequestHandler::Handle(Request request, Peer& peer) {
  const Envelope& message = *request.message;
  if (message.has_cancel_request()) {
    Cancel(message, peer);
    return std::nullopt;
  }
  if (message.has_watch_request()) {
    return watches_.Answer(std::move(request), peer);
  }
  if (!message.has_sync_request()) {
    return Await(std::move(request), peer);
  }
  RequestRecord record(peer.out.peer(), message, request.began);
  auto reply = std::make_shared<SyncReply>(context_.service, frames_, request);
  request.message.reset();
  std::unique_ptr<TurnOrder::Turn> turn;
  if (reply->message().wait_revision() == 0) {
    if (peer.streams.is_empty() && SyncAtOnce(*reply, record, peer.out)) {
      return std::nullopt;
    }
    turn = std::make_unique<TurnOrder::Turn>(peer.streams);
  }
  return Sync(std::move(reply), {std::move(request.held), std::move(request.held_reply)},
              std::move(record), std::move(turn), peer);
}

void RequestHandler::ReturnFreed(FreedMemory::Clock::time_point now) {
  if (freed_.IsDue(now)) {
    asio::post(context_.pool, &ReturnFreeMemory);
  }
}

void RequestHandler::Cancel(const Envelope& request, Peer& peer) {
  RequestRecord record(peer.out.peer(), request);
  Envelope reply = ReplyTo(request);
  const bool is_cancelled = peer.Cancel(request.cancel_request().request_id());
  reply.mutable_cancel_reply()->set_cancelled(is_cancelled);
  peer.out.Push(reply);
  record.End({});
}

asio::awaitable<void> RequestHandler::Await(Request request, Peer& peer) {
  RequestRecord record(peer.out.peer(), *request.message, request.began);
  Status status = co_await Dispatch(request, record, peer);
  record.End(status);
  if (!status.ok()) {
    co_await peer.out.SendError(request.message->request_id(), std::move(status));
  }
}

asio::awaitable<Status> RequestHandler::Dispatch(const Request& whole,
                                                 RequestRecord& record,
                                                 Peer& peer) {
  const Envelope& request = *whole.message;
  switch (request.body_case()) {
    case Envelope::kUploadKeyframe:
      return AnswerUpload(context_, request, peer);
    case Envelope::kUpdatePoses:
      return AnswerUpdatePoses(context_, whole, peer.out);
    case Envelope::kUndoPoses:
      return AnswerUndoPoses(context_, request, peer.out);
    case Envelope::kChangeSession:
      return AnswerChangeSession(context_, request, peer.out);
    case Envelope::kQueryRegion:
      return AnswerQuery(context_, whole, peer);
    case Envelope::kStatusRequest:
      return AnswerStatus(context_, request, peer.out);
    case Envelope::kSessionsRequest:
      return AnswerSessions(context_, request, peer);
    case Envelope::kKeyframesRequest:
      return AnswerKeyframes(context_, request, peer);
    case Envelope::kReadKeyframes:
      return AnswerReadKeyframes(context_, request, peer);
    case Envelope::kWaitRequest:
      return AnswerWait(context_, whole, record, peer.out);
    case Envelope::kDigestRequest:
      return AnswerDigest(context_, whole, peer.out);
    case Envelope::kLogRequest:
      return AnswerLog(context_, request, peer);
    case Envelope::kVerifyRequest:
      return AnswerVerify(context_, whole, peer.out);
    case Envelope::kCompactRequest:
      return AnswerCompact(context_, whole, peer.out);
    case Envelope::kBackupRequest:
      return AnswerBackup(context_, whole, peer.out);
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

bool RequestHandler::SyncAtOnce(SyncReply& reply, RequestRecord& record, ReplyWriter& out) {
  std::vector<ReplyFrame> frames;
  for (std::size_t bytes = 0; bytes < kBytesAtOnce;) {
    const std::size_t room_bytes = out.RoomNow();
    if (room_bytes == 0) {
      return false;
    }
    const Result<SyncReply::Step> step = reply.Next(false, frames, {room_bytes, out.share_bytes()});
    if (!step) {
      out.PushError(reply.request_id(), step.error());
      record.End(step.error());
      return true;
    }
    for (ReplyFrame& frame : frames) {
      bytes += frame.size();
      out.Push(std::move(frame));
    }
    frames.clear();
    if (*step == SyncReply::Step::kDone) {
      EndSync(reply, {}, record);
      return true;
    }
    if (*step == SyncReply::Step::kBlocked) {
      return false;
    }
  }
  return false;
}

asio::awaitable<void> RequestHandler::Sync(std::shared_ptr<SyncReply> reply,
                                           SyncHold hold,
                                           RequestRecord record,
                                           std::unique_ptr<TurnOrder::Turn> turn,
                                           Peer& peer) {
  Status status = co_await WaitAndSync(reply, std::move(hold), std::move(turn), peer);
  EndSync(*reply, status, record);
  if (!status.ok()) {
    co_await peer.out.SendError(reply->request_id(), std::move(status));
  }
}

asio::awaitable<Status> RequestHandler::WaitAndSync(std::shared_ptr<SyncReply> reply,
                                                    SyncHold hold,
                                                    std::unique_ptr<TurnOrder::Turn> turn,
                                                    Peer& peer) {
  if (turn == nullptr) {
    const wire::SyncRequest& message = reply->message();
    const Patience patience(reply->deadline().value_or(SyncReply::Clock::time_point{}),
                            peer.out.peer_left());
    Status status = co_await AwaitRevision(context_, message.wait_revision(), patience, peer.out);
    if (!status.ok()) {
      co_return status;
    }
    turn = std::make_unique<TurnOrder::Turn>(peer.streams);
  }
  co_await turn->Come();
  co_return co_await SendSync(std::move(reply), std::move(hold), context_.reply_pool, peer.out);
}

}  // namespace atlas
