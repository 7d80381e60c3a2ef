// Who watches: every change of a tile goes to all watches. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "server/service/watch/tile_watch.h"

namespace atlas {

class WatchHub {
 public:
  // It hears of what changes from now on, until it is destroyed.
  std::shared_ptr<TileWatch> Open(TileWatch::Scope scope, std::function<void()> wake);
  void Publish(const TileId& id, std::uint64_t revision);
  // That it has in its list: those that are there, and some that were.
  std::size_t listed() const;

 private:
  static constexpr std::size_t kMinListed = 64;  // before it looks for those that are no more

  mutable std::mutex mutex_;
  std::vector<std::weak_ptr<TileWatch>> watches_;
  std::size_t max_listed_ = kMinListed;  // then it looks
};

}  // namespace atlas
