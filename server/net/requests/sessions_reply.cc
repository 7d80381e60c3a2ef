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

// More than one takes in a reply: two names of 64 bytes, a state of 11, seven numbers, whether it
// is damaged, their tags.
constexpr std::size_t kSessionBytes = 229;
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

Result<SessionPage> ReadPage(AtlasService& service,
                             const SessionKey& after,
                             std::uint32_t limit,
                             bool is_with_changes) {
  if (is_with_changes) {
    return service.ListChangedSessions(after, limit);
  }
  auto sessions = service.ListSessions(after, limit + 1);  // whether there are more
  if (!sessions) {
    return Error(sessions.error());
  }
  SessionPage page{*std::move(sessions), false};
  page.has_more = page.sessions.size() > limit;
  page.sessions.resize(std::min<std::size_t>(page.sessions.size(), limit));
  return page;
}

void PageToWire(const SessionPage& page, std::size_t room_bytes, wire::SessionsReply& out) {
  std::size_t count = 0;
  for (std::size_t bytes = 0; count < page.sessions.size(); ++count) {
    bytes += kSessionBytes + page.sessions[count].reason.size();
    if (count > 0 && bytes > room_bytes) {
      break;
    }
    SessionToWire(page.sessions[count], *out.add_sessions());
  }
  out.set_has_more(page.has_more || page.sessions.size() > count);
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
  const Blocking<SessionPage> list = [&context, &message, &after = *after, limit] {
    return ReadPage(context.service, after, limit, message.changed());
  };
  const Result<SessionPage> page = co_await OnPool(context.pool, list);
  if (!page) {
    co_return page.error();
  }
  wire::Envelope reply = ReplyTo(request);
  PageToWire(*page, room.bytes(), *reply.mutable_sessions_reply());
  peer.out.Push(reply);
  peer.out.Flush();
  co_return Status();
}

}  // namespace atlas
