#include "server/service/watch/watch_hub.h"

#include <utility>

namespace atlas {

std::shared_ptr<TileWatch> WatchHub::Open(TileWatch::Scope scope, std::function<void()> wake) {
  auto watch = std::make_shared<TileWatch>(std::move(scope), std::move(wake));
  const std::lock_guard lock(mutex_);
  watches_.push_back(watch);
  return watch;
}

void WatchHub::Publish(const TileId& id, std::uint64_t revision) {
  std::vector<std::shared_ptr<TileWatch>> watches;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(watches_, [&watches](const auto& weak) {
      auto watch = weak.lock();
      const bool is_gone = watch == nullptr;
      if (!is_gone) {
        watches.push_back(std::move(watch));
      }
      return is_gone;
    });
  }
  for (const auto& watch : watches) {
    watch->Add(id, revision);
  }
}

}  // namespace atlas
