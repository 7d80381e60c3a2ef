// The reply to a watch: events, as long as it lasts (docs/protocol.md, "Watch").
#pragma once

#include <chrono>
#include <cstdint>
#include <stop_token>

#include <boost/asio/awaitable.hpp>

#include "proto/wire/envelope.h"
#include "server/net/stream/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// What it is about; the message that said so is not needed any more.
struct WatchOrder {
  TileWatch::Scope scope;
  std::chrono::milliseconds interval;
};
// kInvalidArgument: an area that is none.
Result<WatchOrder> WatchFromWire(const wire::WatchRequest& message, const MapProfile& profile);

// Returns when it is cancelled or the peer is gone, kUnavailable, and on levels that make no sense.
boost::asio::awaitable<Status> SendWatch(AtlasService& service,
                                         std::uint64_t request_id,
                                         WatchOrder order,
                                         std::stop_token cancelled,
                                         ReplyWriter& out);

}  // namespace atlas
