// The reply to a region query: tiles as frames, coarse first, within the byte budget.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>

#include "proto/wire/envelope.h"
#include "server/net/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// kInvalidArgument on levels the atlas does not have, sections this version cannot leave out, or a
// budget too small for the end of the reply.
Result<RegionRequest> RegionFromWire(const wire::QueryRegion& query, const MapProfile& profile);

// Sends every frame of the reply, QueryEnd last. The budget counts whole frames; the first tile
// that does not fit ends the reply.
boost::asio::awaitable<Status> SendRegion(AtlasService& service,
                                          boost::asio::thread_pool& pool,
                                          const wire::Envelope& request,
                                          RegionRequest region,
                                          ReplyWriter& out);

}  // namespace atlas
