#include "server/net/requests/sessions_reply.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "server/net/requests/on_pool.h"
#include "server/net/requests/request_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

// More than one takes in a reply: two names of 64 bytes, a state of 11, six numbers, whether it is
// damaged, their tags.
constexpr std::size_t kSessionBytes = 218;
// That some have besides: pages with many are shorter. An operator's reason is 256 bytes at most,
// and two numbers of keyframes and what is between them some 120.
constexpr std::size_t kReasonBytes = 520;
static_assert(kMaxSessionsOfPage * kSessionBytes + kReasonBytes <= kReplyBatchBytes);

// Behind which one; nothing: from the first one on.
Result<SessionKey> StartFromWire(const wire::SessionsRequest& message) {
  SessionKey after{message.after_vehicle(), message.after_session()};
  Status status = after.vehicle.empty() ? Status() : ValidateName("vehicle", after.vehicle);
  if (status.ok() && !after.session.empty()) {
    status = ValidateName("session", after.session);
  }
  if (!status.ok()) {
    return Error(std::move(status));
  }
  return after;
}

void PageToWire(const std::vector<SessionRecord>& found,
                std::size_t limit,
                std::size_t room_bytes,
                wire::SessionsReply& out) {
  std::size_t count = 0;
  for (std::size_t bytes = 0; count < std::min(found.size(), limit); ++count) {
    bytes += kSessionBytes + found[count].reason.size();
    if (count > 0 && bytes > room_bytes) {
      break;
    }
    SessionToWire(found[count], *out.add_sessions());
  }
  out.set_has_more(found.size() > count);
}

}  // namespace

asio::awaitable<Status> AnswerSessions(RequestContext& context,
                                       const wire::Envelope& request,
                                       Peer& peer) {
  const wire::SessionsRequest& message = request.sessions_request();
  const Result<SessionKey> after = StartFromWire(message);
  if (!after) {
    co_return after.error();
  }
  const std::uint32_t wanted =
      message.limit() == 0 ? kMaxSessionsOfPage : std::min(message.limit(), kMaxSessionsOfPage);
  TurnOrder::Turn turn(peer.streams);
  co_await turn.Come();
  const ReplyWriter::Room room = co_await peer.out.TakeRoom(wanted * kSessionBytes + kReasonBytes);
  if (!room) {
    co_return ReplyWriter::Room::Gone();
  }
  const auto limit =
      static_cast<std::uint32_t>(std::clamp<std::size_t>(room.bytes() / kSessionBytes, 1, wanted));
  const Blocking<std::vector<SessionRecord>> list = [&context, &after = *after, limit] {
    return context.service.ListSessions(after, limit + 1);  // whether there are more
  };
  const Result<std::vector<SessionRecord>> sessions = co_await OnPool(context.pool, list);
  if (!sessions) {
    co_return sessions.error();
  }
  wire::Envelope reply = ReplyTo(request);
  PageToWire(*sessions, limit, room.bytes(), *reply.mutable_sessions_reply());
  peer.out.Push(reply);
  peer.out.Flush();
  co_return Status();
}

}  // namespace atlas
