#include "server/net/requests/watch_reply.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/net/requests/sync_conversion.h"
#include "server/net/requests/wake_up.h"

namespace atlas {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;

// A keyframe changes a dozen tiles one after the other.
constexpr milliseconds kMinInterval{50};
constexpr milliseconds kMaxInterval{60'000};

void EventToWire(const TileChanges& changes, wire::WatchEvent& event) {
  for (const TileChanges::Tile& tile : changes.tiles) {
    event.add_keys(tile.id.Key());
    event.add_revisions(tile.revision);
  }
  for (const TileId& id : changes.below) {
    event.add_below(id.Key());
  }
  event.set_anything(changes.is_anything);
}

// Ends early when nobody waits for what comes then. Both tokens are of the connection's thread.
asio::awaitable<void> Pause(milliseconds time,
                            const std::stop_token& cancelled,
                            const std::stop_token& peer_left) {
  const auto executor = co_await asio::this_coro::executor;
  asio::steady_timer timer(executor, time);
  const auto end = [&timer] {
    timer.cancel();
  };
  const std::stop_callback on_cancelled(cancelled, end);
  const std::stop_callback on_left(peer_left, end);
  if (!cancelled.stop_requested() && !peer_left.stop_requested()) {
    boost::system::error_code ignored;  // the time is over, or it was ended
    co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }
}

}  // namespace

Result<WatchOrder> WatchFromWire(const wire::WatchRequest& message, const MapProfile& profile) {
  Result<SyncArea> area = AreaFromWire(message.area(), profile);
  if (!area) {
    return Error(area.error());
  }
  const auto interval = std::clamp(milliseconds(message.interval_ms()), kMinInterval, kMaxInterval);
  return WatchOrder{{*std::move(area), message.finest_level(), message.coarsest_level()}, interval};
}

asio::awaitable<Status> SendWatch(AtlasService& service,
                                  std::uint64_t request_id,
                                  WatchOrder order,
                                  std::stop_token cancelled,
                                  ReplyWriter& out) {
  const auto executor = co_await asio::this_coro::executor;
  const auto wake_up = std::make_shared<WakeUp>(executor);
  const auto ring = [wake_up] {
    wake_up->Ring();
  };
  const auto watch = service.Watch(std::move(order.scope), ring);
  if (!watch) {
    co_return watch.error();
  }
  const std::stop_token peer_left = out.peer_left();
  const std::stop_callback on_cancelled(cancelled, ring);
  const std::stop_callback on_left(peer_left, ring);
  TileChanges changes;  // nothing at first: from here on everything is told
  std::uint64_t revision = service.revision();
  (*watch)->TellFrom(revision);
  while (!cancelled.stop_requested() && !peer_left.stop_requested()) {
    wire::Envelope event;
    event.set_request_id(request_id);
    event.mutable_watch_event()->set_revision(revision);
    EventToWire(changes, *event.mutable_watch_event());
    const bool is_open = co_await out.Send(std::move(event));
    if (!is_open) {
      break;
    }
    co_await Pause(order.interval, cancelled, peer_left);
    changes = (*watch)->Take();
    while (changes.empty() && !cancelled.stop_requested() && !peer_left.stop_requested()) {
      co_await wake_up->Wait();
      changes = (*watch)->Take();
    }
    revision = service.revision();
  }
  co_return Status(StatusCode::kUnavailable, cancelled.stop_requested()
                                                 ? "the watch was cancelled"
                                                 : "the connection ends, and with it the watch");
}

}  // namespace atlas
