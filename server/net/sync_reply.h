// The reply to a sync: manifests, the tiles that each of them announces, and an end.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>

#include "proto/wire/envelope.h"
#include "server/net/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// Planning and reading run on `pool`, a few tiles at a time, so that a slow reader holds no more
// than that. Errors as AtlasService::PlanSync and SyncFromWire; kInvalidArgument: the budget has no
// room for what there is to say of the held tiles.
boost::asio::awaitable<Status> SendSync(AtlasService& service,
                                        boost::asio::thread_pool& pool,
                                        wire::Envelope request,
                                        ReplyWriter& out);

}  // namespace atlas
