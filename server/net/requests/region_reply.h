// The reply to a region query: tiles as frames, coarse first, within the byte budget.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>

#include "proto/wire/envelope.h"
#include "server/net/stream/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// kUnsupported on a choice of sections, which this version cannot make.
Result<RegionRequest> RegionFromWire(const wire::QueryRegion& query);

// Sends every frame of the reply, QueryEnd last. The budget counts whole frames; the first tile
// that does not fit ends the reply. Tiles are read on `pool`, those of an earlier revision fused
// there, one at a time.
boost::asio::awaitable<Status> SendRegion(AtlasService& service,
                                          boost::asio::thread_pool& pool,
                                          const wire::Envelope& request,
                                          RegionRequest region,
                                          ReplyWriter& out);

}  // namespace atlas
