#include "server/service/watch/watch_hub.h"

#include <algorithm>
#include <utility>

namespace atlas {

std::shared_ptr<TileWatch> WatchHub::Open(TileWatch::Scope scope, std::function<void()> wake) {
  auto watch = std::make_shared<TileWatch>(std::move(scope), std::move(wake));
  const std::lock_guard lock(mutex_);
  if (watches_.size() >= max_listed_) {  // perhaps nothing is ever published
    std::erase_if(watches_, [](const auto& weak) { return weak.expired(); });
    max_listed_ = std::max(kMinListed, 2 * watches_.size());
  }
  watches_.push_back(watch);
  return watch;
}

std::size_t WatchHub::listed() const {
  const std::lock_guard lock(mutex_);
  return watches_.size();
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
