// Turns an asynchronous store write into a blocking call, for threads that may wait.
#pragma once

#include <future>
#include <memory>
#include <utility>

#include "core/base/status.h"

namespace atlas {

// `start` is called with the callback to pass as `done`:
//   Await<FinishResult>([&](auto done) { store.FinishTile(tile, std::move(done)); })
template <typename T, typename Start>
Result<T> Await(Start&& start) {
  auto promise = std::make_shared<std::promise<Result<T>>>();
  std::future<Result<T>> future = promise->get_future();
  std::forward<Start>(start)(
      [promise](Result<T> result) { promise->set_value(std::move(result)); });
  return future.get();
}

}  // namespace atlas
