#include "server/net/requests/read_requests.h"

#include <algorithm>
#include <cstddef>
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
// As much as one takes: a retraction with the longest names and reason.
constexpr std::size_t kEventBytes = 512;
static_assert(kMaxEvents * kEventBytes <= kReplyBatchBytes);

// Fusing is long work: it has places and threads of its own, and ends when the peer leaves.
asio::awaitable<Status> QueryThePast(RequestContext& context,
                                     const wire::Envelope& request,
                                     const RegionRequest& region,
                                     Patience patience,
                                     ReplyWriter& out) {
  const Result<Places::Place> place = context.works.Take(out.peer());
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
  const wire::LogRequest& message = request.log_request();
  const std::uint32_t wanted =
      message.limit() == 0 ? kMaxEvents : std::min(message.limit(), kMaxEvents);
  const ReplyWriter::Room room = co_await peer.out.TakeRoom(wanted * kEventBytes);
  if (!room) {
    co_return ReplyWriter::Room::Gone();
  }
  const auto limit =
      static_cast<std::uint32_t>(std::max<std::size_t>(1, room.bytes() / kEventBytes));
  const Blocking<std::vector<Event>> list = [&context, &message, limit] {
    return context.service.ListEvents(message.after_id(), limit);
  };
  const Result<std::vector<Event>> events = co_await OnPool(context.pool, list);
  co_return co_await Answer(request, events, &wire::Envelope::mutable_log_reply, EventsToWire,
                            peer.out);
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
  const Result<Places::Place> place = context.waits.Take(out.peer());
  if (!place) {
    co_return place.error();
  }
  co_return co_await WaitForRevision(context.service, context.pool, revision, patience);
}

}  // namespace atlas
