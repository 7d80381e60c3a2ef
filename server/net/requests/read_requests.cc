#include "server/net/requests/read_requests.h"

#include <optional>
#include <utility>
#include <vector>

#include "server/net/requests/answer.h"
#include "server/net/requests/atlas_wait.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/region_reply.h"
#include "server/net/requests/request_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

constexpr std::uint32_t kMaxEvents = 1'000;  // of a reply

void SessionsToWire(const std::vector<SessionRecord>& sessions, wire::SessionsReply& out) {
  for (const SessionRecord& record : sessions) {
    SessionToWire(record, *out.add_sessions());
  }
}

// Fusing is long work: it has places and threads of its own, and ends when the peer leaves.
asio::awaitable<Status> QueryThePast(RequestContext& context,
                                     const wire::Envelope& request,
                                     const RegionRequest& region,
                                     Patience patience,
                                     ReplyWriter& out) {
  const Result<Places::Place> place = context.places.Take(out.peer().share.get());
  if (!place) {
    co_return place.error();
  }
  co_return co_await SendRegion(context.service, context.reading_pool, request, region,
                                std::move(patience), out);
}

}  // namespace

asio::awaitable<Status> AnswerQuery(RequestContext& context, const Request& whole, Peer& peer) {
  ReplyWriter& out = peer.out;
  const wire::Envelope& request = *whole.message;
  const wire::QueryRegion& query = request.query_region();
  const Patience patience = PatienceOf(whole, query.timeout_ms(), out);
  const Result<RegionRequest> region = RegionFromWire(query);
  if (!region) {
    co_return region.error();
  }
  if (query.has_at_revision()) {
    co_return co_await QueryThePast(context, request, *region, patience, out);
  }
  Status status = co_await AwaitRevision(context, query.wait_revision(), patience, out);
  if (!status.ok()) {
    co_return status;
  }
  TurnOrder::Turn turn(peer.streams);
  co_await turn.Come();
  co_return co_await SendRegion(context.service, context.reply_pool, request, *region, std::nullopt,
                                out);
}

asio::awaitable<Status> AnswerStatus(RequestContext& context,
                                     const wire::Envelope& request,
                                     ReplyWriter& out) {
  const Blocking<ServiceStatus> read = [&context] {
    return context.service.ReadStatus();
  };
  const Result<ServiceStatus> status = co_await OnPool(context.pool, read);
  co_return co_await Answer(request, status, &wire::Envelope::mutable_status_reply, StatusToWire,
                            out);
}

asio::awaitable<Status> AnswerLog(RequestContext& context,
                                  const wire::Envelope& request,
                                  Peer& peer) {
  TurnOrder::Turn turn(peer.streams);
  co_await turn.Come();
  const bool is_open = co_await peer.out.WaitForRoom();
  if (!is_open) {
    co_return Status();
  }
  const wire::LogRequest& message = request.log_request();
  const std::uint32_t limit = message.limit() == 0 ? kMaxEvents : message.limit();
  const Blocking<std::vector<Event>> list = [&context, &message, limit] {
    return context.service.ListEvents(message.after_id(), std::min(limit, kMaxEvents));
  };
  const Result<std::vector<Event>> events = co_await OnPool(context.pool, list);
  co_return co_await Answer(request, events, &wire::Envelope::mutable_log_reply, EventsToWire,
                            peer.out);
}

asio::awaitable<Status> AnswerSessions(RequestContext& context,
                                       const wire::Envelope& request,
                                       Peer& peer) {
  TurnOrder::Turn turn(peer.streams);  // there may be many
  co_await turn.Come();
  const bool is_open = co_await peer.out.WaitForRoom();
  if (!is_open) {
    co_return Status();
  }
  const Blocking<std::vector<SessionRecord>> list = [&context] {
    return context.service.ListSessions();
  };
  const Result<std::vector<SessionRecord>> sessions = co_await OnPool(context.pool, list);
  co_return co_await Answer(request, sessions, &wire::Envelope::mutable_sessions_reply,
                            SessionsToWire, peer.out);
}

asio::awaitable<Status> AwaitRevision(RequestContext& context,
                                      std::uint64_t revision,
                                      Patience patience,
                                      const ReplyWriter& out) {
  if (revision == 0) {
    co_return Status();
  }
  const Patience no_wait(Patience::Clock::time_point{}, out.peer_left());
  Status now = co_await WaitForRevision(context.service, context.pool, revision, no_wait);
  if (now.code() != StatusCode::kTimeout || patience.is_over()) {
    co_return now;  // whoever does not wait takes no place
  }
  const Result<Places::Place> place = context.places.Take(out.peer().share.get());
  if (!place) {
    co_return place.error();
  }
  co_return co_await WaitForRevision(context.service, context.pool, revision, patience);
}

}  // namespace atlas
