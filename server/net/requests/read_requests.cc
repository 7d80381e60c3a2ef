#include "server/net/requests/read_requests.h"

#include <vector>

#include "server/net/requests/answer.h"
#include "server/net/requests/atlas_wait.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/region_reply.h"
#include "server/net/requests/request_conversion.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

void SessionsToWire(const std::vector<SessionRecord>& sessions, wire::SessionsReply& out) {
  for (const SessionRecord& record : sessions) {
    SessionToWire(record, *out.add_sessions());
  }
}

// Fusing is long work: it has places and threads of its own, and ends when the peer leaves.
asio::awaitable<Status> QueryThePast(RequestContext& context,
                                     const wire::Envelope& request,
                                     const RegionRequest& region,
                                     ReplyWriter& out) {
  const Result<Places::Place> place = context.places.Take();
  if (!place) {
    co_return place.error();
  }
  co_return co_await SendRegion(context.service, context.reading_pool, request, region, out);
}

}  // namespace

asio::awaitable<Status> AnswerQuery(RequestContext& context,
                                    const wire::Envelope& request,
                                    ReplyWriter& out) {
  const wire::QueryRegion& query = request.query_region();
  const Result<RegionRequest> region = RegionFromWire(query);
  if (!region) {
    co_return region.error();
  }
  if (query.has_at_revision()) {
    co_return co_await QueryThePast(context, request, *region, out);
  }
  Status status = co_await AwaitRevision(context, query.wait_revision(), query.timeout_ms(), out);
  if (!status.ok()) {
    co_return status;
  }
  co_return co_await SendRegion(context.service, context.pool, request, *region, out);
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

asio::awaitable<Status> AnswerSessions(RequestContext& context,
                                       const wire::Envelope& request,
                                       ReplyWriter& out) {
  const Blocking<std::vector<SessionRecord>> list = [&context] {
    return context.service.ListSessions();
  };
  const Result<std::vector<SessionRecord>> sessions = co_await OnPool(context.pool, list);
  co_return co_await Answer(request, sessions, &wire::Envelope::mutable_sessions_reply,
                            SessionsToWire, out);
}

asio::awaitable<Status> AwaitRevision(RequestContext& context,
                                      std::uint64_t revision,
                                      std::uint32_t timeout_ms,
                                      const ReplyWriter& out) {
  if (revision == 0) {
    co_return Status();
  }
  const Result<Places::Place> place = context.places.Take();
  if (!place) {
    co_return place.error();
  }
  const Patience patience{TimeoutFromWire(timeout_ms), out.peer_left()};
  co_return co_await WaitForRevision(context.service, context.pool, revision, patience);
}

}  // namespace atlas
