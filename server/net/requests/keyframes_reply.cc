#include "server/net/requests/keyframes_reply.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>

#include "proto/wire/convert.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/request_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

// More than one takes in a reply: a sequence number, a time, three coordinates and four numbers of
// a quaternion, their tags.
constexpr std::size_t kKeyframeBytes = 80;
static_assert(kMaxKeyframesOfPage * kKeyframeBytes <= kReplyBatchBytes);

void PageToWire(const KeyframePage& page, wire::KeyframesReply& out) {
  for (const KeyframeRecord& keyframe : page.keyframes) {
    wire::KeyframeInfo& info = *out.add_keyframes();
    info.set_sequence(keyframe.key.sequence);
    info.set_time_ms(keyframe.time_ms);
    *info.mutable_pose() = PoseToWire(keyframe.pose);
  }
  out.set_has_more(page.has_more);
}

}  // namespace

asio::awaitable<Status> AnswerKeyframes(RequestContext& context,
                                        const wire::Envelope& request,
                                        Peer& peer) {
  const wire::KeyframesRequest& message = request.keyframes_request();
  const SessionKey session{message.vehicle(), message.session()};
  if (Status status = session.Validate(); !status.ok()) {
    co_return status;
  }
  const std::uint32_t wanted =
      message.limit() == 0 ? kMaxKeyframesOfPage : std::min(message.limit(), kMaxKeyframesOfPage);
  TurnOrder::Turn turn(peer.streams);
  co_await turn.Come();
  const ReplyWriter::Room room = co_await peer.out.TakeRoom(wanted * kKeyframeBytes);
  if (!room) {
    co_return ReplyWriter::Room::Gone();
  }
  const auto limit =
      static_cast<std::uint32_t>(std::clamp<std::size_t>(room.bytes() / kKeyframeBytes, 1, wanted));
  const std::optional<std::uint32_t> after =
      message.has_after_sequence() ? std::optional(message.after_sequence()) : std::nullopt;
  const Blocking<KeyframePage> list = [&context, &session, after, limit] {
    return context.service.ListKeyframes(session, after, limit);
  };
  const Result<KeyframePage> page = co_await OnPool(context.pool, list);
  if (!page) {
    co_return page.error();
  }
  wire::Envelope reply = ReplyTo(request);
  PageToWire(*page, *reply.mutable_keyframes_reply());
  peer.out.Push(reply);
  peer.out.Flush();
  co_return Status();
}

}  // namespace atlas
