// Waiting for the workers on behalf of a peer: the wait looks again and again, so that no thread
// waits with it.
#pragma once

#include <chrono>
#include <cstdint>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/net/requests/request.h"
#include "server/net/stream/reply_writer.h"
#include "server/service/atlas_service.h"

namespace atlas {

// How long a request with this `timeout_ms` may take: 0 does not wait, more than a day is a day.
std::chrono::milliseconds TimeoutFromWire(std::uint32_t timeout_ms);
// The same from when it was read on, or until its peer leaves.
Patience PatienceOf(const Request& request, std::uint32_t timeout_ms, const ReplyWriter& out);

// Until nothing is dirty but damaged tiles, or until the time is up: the outcome tells. Each look
// runs on `pool`.
boost::asio::awaitable<Result<WaitOutcome>> WaitUntilClean(AtlasService& service,
                                                           boost::asio::thread_pool& pool,
                                                           Patience patience);

// The same, and kTimeout when the time is up first.
boost::asio::awaitable<Result<WaitOutcome>> RequireSettled(AtlasService& service,
                                                           boost::asio::thread_pool& pool,
                                                           Patience patience);

// Until the tiles reflect `revision`; kTimeout if they do not in time.
boost::asio::awaitable<Status> WaitForRevision(AtlasService& service,
                                               boost::asio::thread_pool& pool,
                                               std::uint64_t revision,
                                               Patience patience);

}  // namespace atlas
