#include "server/net/requests/atlas_wait.h"

#include <algorithm>
#include <utility>

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "core/base/str_cat.h"
#include "server/net/requests/on_pool.h"

namespace atlas {
namespace {

namespace asio = boost::asio;

constexpr std::chrono::milliseconds kLongestTimeout{86'400'000};

// Pauses between two looks at what is still dirty.
class Pauses {
 public:
  explicit Pauses(const asio::any_io_executor& executor) : timer_(executor) {}

  asio::awaitable<void> Next() {
    timer_.expires_after(pause_);
    pause_ = std::min(2 * pause_, kLongest);
    co_await timer_.async_wait(asio::use_awaitable);
  }

 private:
  static constexpr std::chrono::milliseconds kLongest{100};

  asio::steady_timer timer_;
  std::chrono::milliseconds pause_{2};
};

}  // namespace

std::chrono::milliseconds TimeoutFromWire(std::uint32_t timeout_ms) {
  return std::min(std::chrono::milliseconds(timeout_ms), kLongestTimeout);
}

Patience PatienceOf(const Request& request, std::uint32_t timeout_ms, const ReplyWriter& out) {
  return {request.began + TimeoutFromWire(timeout_ms), out.peer_left()};
}

asio::awaitable<Result<WaitOutcome>> WaitUntilClean(AtlasService& service,
                                                    asio::thread_pool& pool,
                                                    Patience patience) {
  Pauses pauses(co_await asio::this_coro::executor);
  const Patience no_wait(Patience::Clock::time_point{}, patience.stop);
  const Blocking<WaitOutcome> look = [&service, no_wait] {
    return service.WaitUntilClean(no_wait);
  };
  while (true) {
    Result<WaitOutcome> outcome = co_await OnPool(pool, look);
    if (!outcome || !outcome->is_timed_out || patience.is_over()) {
      co_return outcome;
    }
    co_await pauses.Next();
  }
}

asio::awaitable<Result<WaitOutcome>> RequireSettled(AtlasService& service,
                                                    asio::thread_pool& pool,
                                                    Patience patience) {
  Result<WaitOutcome> outcome = co_await WaitUntilClean(service, pool, patience);
  if (outcome && outcome->is_timed_out) {
    co_return Error(StatusCode::kTimeout, StrCat("the time is over, and ", outcome->dirty_tiles,
                                                 " tiles are still to be fused"));
  }
  co_return outcome;
}

asio::awaitable<Status> WaitForRevision(AtlasService& service,
                                        asio::thread_pool& pool,
                                        std::uint64_t revision,
                                        Patience patience) {
  Pauses pauses(co_await asio::this_coro::executor);
  const Patience no_wait(Patience::Clock::time_point{}, patience.stop);
  const Blocking<bool> look = [&service, no_wait, revision]() -> Result<bool> {
    const Status status = service.WaitForRevision(revision, no_wait);
    if (status.ok() || status.code() == StatusCode::kTimeout) {
      return status.ok();
    }
    return Error(status);
  };
  while (true) {
    const Result<bool> is_reached = co_await OnPool(pool, look);
    if (!is_reached) {
      co_return is_reached.error();
    }
    if (*is_reached) {
      co_return Status();
    }
    if (patience.is_over()) {
      co_return Status(
          StatusCode::kTimeout,
          StrCat("the time is over, and the tiles do not reflect revision ", revision, " yet"));
    }
    co_await pauses.Next();
  }
}

}  // namespace atlas
