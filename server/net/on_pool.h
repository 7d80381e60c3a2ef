// Runs a blocking call on a thread pool and awaits its result.
#pragma once

#include <functional>
#include <memory>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/net/one_shot.h"

namespace atlas {

// A call that may block. Always a named variable: g++ 12 destroys the captures of a lambda that is
// written inside a co_await expression twice (GCC PR 99576).
template <typename T>
using Blocking = std::function<Result<T>()>;

template <typename T>
boost::asio::awaitable<Result<T>> OnPool(boost::asio::thread_pool& pool, Blocking<T> call) {
  const auto result = std::make_shared<OneShot<T>>(co_await boost::asio::this_coro::executor);
  boost::asio::post(pool, [result, call = std::move(call)] { result->Set(call()); });
  co_return co_await result->Take();
}

}  // namespace atlas
