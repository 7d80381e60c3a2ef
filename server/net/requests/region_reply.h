// The reply to a region query: tiles as frames, coarse first, within the byte budget.
#pragma once

#include <optional>

#include <boost/asio/awaitable.hpp>

#include "proto/wire/envelope.h"
#include "server/net/requests/fair_pool.h"
#include "server/net/stream/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// kUnsupported on a choice of sections, which this version cannot make.
Result<RegionRequest> RegionFromWire(const wire::QueryRegion& query);

// Sends every frame of the reply, QueryEnd last. The budget counts whole frames; the first tile
// that does not fit ends the reply. Tiles are read on `pool`, those of an earlier revision fused
// there, one at a time. kTimeout: it was not done in the time that it has, if that has an end.
boost::asio::awaitable<Status> SendRegion(AtlasService& service,
                                          FairPool& pool,
                                          const wire::Envelope& request,
                                          RegionRequest region,
                                          std::optional<Patience> patience,
                                          ReplyWriter& out);

}  // namespace atlas
