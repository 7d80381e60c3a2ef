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

// More than one takes in a reply: two names of 64 bytes, a state of 11, six numbers, their tags.
constexpr std::size_t kSessionBytes = 216;
static_assert(kMaxSessionsOfPage * kSessionBytes <= kReplyBatchBytes);

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
                wire::SessionsReply& out) {
  const std::size_t count = std::min(found.size(), limit);
  for (std::size_t i = 0; i < count; ++i) {
    SessionToWire(found[i], *out.add_sessions());
  }
  out.set_has_more(found.size() > limit);
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
  const ReplyWriter::Room room = co_await peer.out.TakeRoom(wanted * kSessionBytes);
  if (!room) {
    co_return Status();
  }
  const auto limit =
      static_cast<std::uint32_t>(std::max<std::size_t>(1, room.bytes() / kSessionBytes));
  const Blocking<std::vector<SessionRecord>> list = [&context, &after = *after, limit] {
    return context.service.ListSessions(after, limit + 1);  // whether there are more
  };
  const Result<std::vector<SessionRecord>> sessions = co_await OnPool(context.pool, list);
  if (!sessions) {
    co_return sessions.error();
  }
  wire::Envelope reply = ReplyTo(request);
  PageToWire(*sessions, limit, *reply.mutable_sessions_reply());
  peer.out.Push(reply);
  peer.out.Flush();
  co_return Status();
}

}  // namespace atlas
