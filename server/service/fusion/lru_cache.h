// Values by number, least recently used first out, bounded by bytes. Shared by the workers.
// Disposable: losing it costs time only. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>

#include "core/base/lru_list.h"

namespace atlas {

template <typename T>
class LruCache {
 public:
  using Handle = std::shared_ptr<const T>;

  explicit LruCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // Null if it is not there.
  Handle Find(std::uint64_t key) {
    const std::lock_guard lock(mutex_);
    const Handle* found = values_.Use(key);
    return found == nullptr ? nullptr : *found;
  }

  // Where there is one of the key already, that one stays.
  void Insert(std::uint64_t key, Handle value, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    if (values_.Find(key) == nullptr) {
      values_.Insert(key, std::move(value), bytes);
    }
    while (values_.TakeOldestAbove(max_bytes_)) {
    }
  }

  std::size_t bytes() const {
    const std::lock_guard lock(mutex_);
    return values_.bytes();
  }

 private:
  std::size_t max_bytes_;
  mutable std::mutex mutex_;
  LruList<Handle> values_;
};

}  // namespace atlas
