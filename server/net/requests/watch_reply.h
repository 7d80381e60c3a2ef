// The reply to a watch: events, as long as it lasts (docs/protocol.md, "Watch").
#pragma once

#include <stop_token>

#include <boost/asio/awaitable.hpp>

#include "proto/wire/envelope.h"
#include "server/net/stream/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// Returns when it is cancelled or the peer is gone, kUnavailable, and on a request that makes no
// sense.
boost::asio::awaitable<Status> SendWatch(AtlasService& service,
                                         const wire::Envelope& request,
                                         std::stop_token cancelled,
                                         ReplyWriter& out);

}  // namespace atlas
