// Waiting for the workers on behalf of a peer: the wait looks again and again, so that no thread
// waits with it.
#pragma once

#include <chrono>
#include <cstdint>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/service/atlas_service.h"

namespace atlas {

// How long a request with this `timeout_ms` may wait: 0 is a minute, more than an hour is an hour.
std::chrono::milliseconds TimeoutFromWire(std::uint32_t timeout_ms);

// Until nothing is dirty; kTimeout says how many tiles still are. Each look runs on `pool`.
boost::asio::awaitable<Result<WaitOutcome>> WaitUntilClean(AtlasService& service,
                                                           boost::asio::thread_pool& pool,
                                                           std::chrono::milliseconds timeout);

// Until the tiles reflect `revision`; kTimeout if they do not in time.
boost::asio::awaitable<Status> WaitForRevision(AtlasService& service,
                                               boost::asio::thread_pool& pool,
                                               std::uint64_t revision,
                                               std::chrono::milliseconds timeout);

}  // namespace atlas
