#include "server/net/requests/watch_requests.h"

#include <utility>

#include "core/base/str_cat.h"
#include "server/net/requests/on_pool.h"
#include "server/net/requests/request_record.h"

namespace atlas {

namespace asio = boost::asio;

asio::awaitable<void> WatchRequests::Answer(Request request, Peer& peer) {
  RequestRecord record(peer.out.peer(), *request.message, request.began);
  const std::uint64_t id = request.message->request_id();
  Result<Places::Place> place = TakePlace(peer.out.peer().share.get());
  Status status;
  if (!place) {
    status = place.error();
  } else if (!peer.Begin(id)) {
    status = {StatusCode::kInvalidArgument,
              StrCat("watch ", id, ": there is one under this id, or there are ",
                     Peer::kMaxCancellable, " on this connection")};
  } else {
    status = co_await Follow(std::move(request), peer);
    peer.End(id);
    place->reset();  // whoever hears of the end may begin another
    const bool is_over = status.code() == StatusCode::kUnavailable;  // as every watch once is
    record.End(is_over ? Status() : status);
  }
  record.End(status);
  co_await peer.out.SendError(id, std::move(status));
}

Result<Places::Place> WatchRequests::TakePlace(PeerShare* share) {
  Places::Place own;
  if (share != nullptr) {
    own = share->watches.Take();
    if (own == nullptr) {
      return Error(StatusCode::kUnavailable,
                   StrCat(share->watches.max_places(), " watches of ", share->whose,
                          " are under way already; try again later"));
    }
  }
  Places::Place place = places_.Take();
  if (place == nullptr) {
    return Error(StatusCode::kUnavailable,
                 StrCat(places_.max_places(), " watches are under way already; try again later"));
  }
  return Places::Both(std::move(own), std::move(place));
}

asio::awaitable<Status> WatchRequests::Follow(Request request, Peer& peer) {
  const std::uint64_t id = request.message->request_id();
  Result<WatchOrder> order = co_await Read(request);
  request.Drop();  // a watch may last for days
  if (!order) {
    co_return order.error();
  }
  const auto memory = memory_.Take(order->scope.area.bytes(), peer.watched, peer.out.peer().share);
  if (!memory) {
    co_return memory.error();
  }
  co_return co_await SendWatch(service_, id, *std::move(order), peer.cancelled(id), peer.out);
}

asio::awaitable<Result<WatchOrder>> WatchRequests::Read(const Request& request) {
  const wire::WatchRequest& message = request.message->watch_request();
  const MapProfile& profile = service_.identity().profile;
  if (!request.is_large) {
    co_return WatchFromWire(message, profile);
  }
  const Blocking<WatchOrder> read = [&message, &profile] {
    return WatchFromWire(message, profile);
  };
  co_return co_await OnPool(large_.pool(), read);
}

}  // namespace atlas
