// Decoded keyframes, least recently used first out, bounded by bytes. Shared by the workers: tiles
// beside each other are made of the same keyframes. Disposable: losing it costs time only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "core/base/status.h"
#include "core/keyframe/keyframe.h"

namespace atlas {

class KeyframeCache {
 public:
  using Handle = std::shared_ptr<const Keyframe>;
  using Load = std::function<Result<Keyframe>(std::int64_t id)>;

  explicit KeyframeCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // From the cache, else from `load`, outside of any lock.
  Result<Handle> Get(std::int64_t id, const Load& load);
  std::size_t bytes() const;

 private:
  struct Entry {
    std::int64_t id = 0;
    Handle keyframe;
    std::size_t bytes = 0;
  };

  Handle Find(std::int64_t id);
  void Insert(std::int64_t id, Handle keyframe);

  std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::list<Entry> by_age_;  // most recently used first
  std::unordered_map<std::int64_t, std::list<Entry>::iterator> by_id_;
  std::size_t bytes_ = 0;
};

}  // namespace atlas
