#include "server/service/keyframe_cache.h"

#include <utility>

namespace atlas {
namespace {

std::size_t SizeOf(const Keyframe& keyframe) {
  return sizeof(Keyframe) + keyframe.cells.capacity() * sizeof(KeyframeCell) +
         keyframe.columns.capacity() * sizeof(std::uint64_t) +
         keyframe.anchors.capacity() * sizeof(std::int16_t);
}

}  // namespace

Result<KeyframeCache::Handle> KeyframeCache::Get(std::int64_t id, const Load& load) {
  if (Handle found = Find(id)) {
    return found;
  }
  auto keyframe = load(id);
  if (!keyframe) {
    return Error(keyframe.error());
  }
  auto handle = std::make_shared<const Keyframe>(std::move(*keyframe));
  Insert(id, handle);
  return Handle(std::move(handle));
}

std::size_t KeyframeCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

KeyframeCache::Handle KeyframeCache::Find(std::int64_t id) {
  const std::lock_guard lock(mutex_);
  const auto found = by_id_.find(id);
  if (found == by_id_.end()) {
    return nullptr;
  }
  by_age_.splice(by_age_.begin(), by_age_, found->second);
  return found->second->keyframe;
}

void KeyframeCache::Insert(std::int64_t id, Handle keyframe) {
  const std::size_t bytes = SizeOf(*keyframe);
  const std::lock_guard lock(mutex_);
  if (by_id_.contains(id)) {
    return;  // another worker was faster
  }
  by_age_.push_front({id, std::move(keyframe), bytes});
  by_id_[id] = by_age_.begin();
  bytes_ += bytes;
  while (bytes_ > max_bytes_ && !by_age_.empty()) {
    bytes_ -= by_age_.back().bytes;
    by_id_.erase(by_age_.back().id);
    by_age_.pop_back();
  }
}

}  // namespace atlas
