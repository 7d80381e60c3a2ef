// Runs a blocking call on a thread pool and awaits its result.
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/net/requests/one_shot.h"

namespace atlas {

// A call that may block, or one that hands its callback on to be called later. Always a named
// variable: g++ 12 destroys lambdas, braced aggregates and results of `?:` that are written inside
// a co_await expression twice (GCC PR 99576).
template <typename T>
using Blocking = std::function<Result<T>()>;
template <typename T>
using Starting = std::function<void(std::function<void(Result<T>)> done)>;

// What the call throws becomes kInternal: on the pool's thread it would end the process.
template <typename T>
boost::asio::awaitable<Result<T>> StartOnPool(boost::asio::thread_pool& pool, Starting<T> start) {
  const auto result = std::make_shared<OneShot<T>>(co_await boost::asio::this_coro::executor);
  boost::asio::post(pool, [result, start = std::move(start)] {
    try {
      start([result](Result<T> value) { result->Set(std::move(value)); });
    } catch (const std::exception& error) {
      result->Set(Error(StatusCode::kInternal, error.what()));
    }
  });
  co_return co_await result->Take();
}

template <typename T>
boost::asio::awaitable<Result<T>> OnPool(boost::asio::thread_pool& pool, Blocking<T> call) {
  Starting<T> start = [call = std::move(call)](const std::function<void(Result<T>)>& done) {
    done(call());
  };
  co_return co_await StartOnPool<T>(pool, std::move(start));
}

}  // namespace atlas
