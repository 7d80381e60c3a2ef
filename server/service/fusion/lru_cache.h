// Values by number, least recently used first out, bounded by bytes. Shared by the workers.
// Disposable: losing it costs time only. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>

namespace atlas {

template <typename T>
class LruCache {
 public:
  using Handle = std::shared_ptr<const T>;

  explicit LruCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // Null if it is not there.
  Handle Find(std::uint64_t key) {
    const std::lock_guard lock(mutex_);
    const auto found = by_key_.find(key);
    if (found == by_key_.end()) {
      return nullptr;
    }
    by_age_.splice(by_age_.begin(), by_age_, found->second);
    return found->second->value;
  }

  // Where there is one of the key already, that one stays.
  void Insert(std::uint64_t key, Handle value, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    if (by_key_.contains(key)) {
      return;
    }
    by_age_.push_front({key, std::move(value), bytes});
    by_key_[key] = by_age_.begin();
    bytes_ += bytes;
    while (bytes_ > max_bytes_ && !by_age_.empty()) {
      bytes_ -= by_age_.back().bytes;
      by_key_.erase(by_age_.back().key);
      by_age_.pop_back();
    }
  }

  std::size_t bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
  }

 private:
  struct Entry {
    std::uint64_t key = 0;
    Handle value;
    std::size_t bytes = 0;
  };

  std::size_t max_bytes_;
  mutable std::mutex mutex_;
  std::list<Entry> by_age_;  // most recently used first
  std::unordered_map<std::uint64_t, typename std::list<Entry>::iterator> by_key_;
  std::size_t bytes_ = 0;
};

}  // namespace atlas
