// Values by number and by age, and the bytes that they take: what caches are made of.
// Not thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <list>
#include <optional>
#include <unordered_map>
#include <utility>

namespace atlas {

template <typename T>
class LruList {
 public:
  // The newest, but for those of which `is_newer` is true. Replaces one of the key.
  void Insert(std::uint64_t key, T value, std::size_t bytes) {
    Insert(key, std::move(value), bytes, [](const T&) { return false; });
  }
  template <typename IsNewer>
  void Insert(std::uint64_t key, T value, std::size_t bytes, const IsNewer& is_newer) {
    Take(key);
    const auto place = std::find_if(by_age_.begin(), by_age_.end(),
                                    [&](const Entry& entry) { return !is_newer(entry.value); });
    by_key_[key] = by_age_.insert(place, {key, std::move(value), bytes});
    bytes_ += bytes;
  }

  // Null if it is not there.
  const T* Find(std::uint64_t key) const {
    const auto found = by_key_.find(key);
    return found == by_key_.end() ? nullptr : &found->second->value;
  }
  // The same; it is the newest from now on.
  T* Use(std::uint64_t key) {
    const auto found = by_key_.find(key);
    if (found == by_key_.end()) {
      return nullptr;
    }
    by_age_.splice(by_age_.begin(), by_age_, found->second);
    return &found->second->value;
  }

  // Takes one out.
  std::optional<T> Take(std::uint64_t key) {
    const auto found = by_key_.find(key);
    return found == by_key_.end() ? std::nullopt : std::optional(Remove(found->second).value);
  }
  // The oldest, if they take more than `bytes` together.
  std::optional<T> TakeOldestAbove(std::size_t bytes) {
    if (bytes_ <= bytes || by_age_.empty()) {
      return std::nullopt;
    }
    return Remove(std::prev(by_age_.end())).value;
  }
  // The oldest of those of which `is_wanted` is true.
  template <typename IsWanted>
  std::optional<T> TakeOldest(const IsWanted& is_wanted) {
    const auto found = std::find_if(by_age_.rbegin(), by_age_.rend(),
                                    [&](const Entry& entry) { return is_wanted(entry.value); });
    return found == by_age_.rend() ? std::nullopt
                                   : std::optional(Remove(std::prev(found.base())).value);
  }

  std::size_t bytes() const { return bytes_; }

 private:
  struct Entry {
    std::uint64_t key = 0;
    T value;
    std::size_t bytes = 0;
  };
  using Place = typename std::list<Entry>::iterator;

  Entry Remove(Place place) {
    Entry entry = std::move(*place);
    bytes_ -= entry.bytes;
    by_key_.erase(entry.key);
    by_age_.erase(place);
    return entry;
  }

  std::list<Entry> by_age_;  // the newest first
  std::unordered_map<std::uint64_t, Place> by_key_;
  std::size_t bytes_ = 0;
};

}  // namespace atlas
