// What may be held of something by many together, so that they cannot fill the memory that each of
// them alone may not. Thread-safe.
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>

namespace atlas {

class ByteBudget {
 public:
  explicit ByteBudget(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // False, and nothing taken, when that is more than is left.
  bool Take(std::size_t bytes) {
    const std::size_t max_bytes = max_bytes_.load();
    std::size_t taken_bytes = taken_bytes_.load();
    do {
      if (taken_bytes > max_bytes || bytes > max_bytes - taken_bytes) {
        return false;
      }
    } while (!taken_bytes_.compare_exchange_weak(taken_bytes, taken_bytes + bytes));
    return true;
  }
  // Takes them, whether they are left or not.
  void Add(std::size_t bytes) { taken_bytes_.fetch_add(bytes); }
  void GiveBack(std::size_t bytes) {
    [[maybe_unused]] const std::size_t taken_bytes = taken_bytes_.fetch_sub(bytes);
    assert(bytes <= taken_bytes);
  }
  std::size_t max_bytes() const { return max_bytes_.load(); }
  // What one of many may have: an eighth of what is free. The more of them take theirs, the less
  // it is: together they never take all, and whoever comes finds as much as they have. (Choudhury,
  // Hahne: Dynamic queue length thresholds for shared-memory packet switches, 1998, with 1/8.)
  std::size_t share_bytes() const {
    const std::size_t max_bytes = max_bytes_.load();
    return (max_bytes - std::min(max_bytes, taken_bytes_.load())) / 8;
  }
  // What was taken stays taken.
  void set_max_bytes(std::size_t max_bytes) { max_bytes_.store(max_bytes); }
  std::size_t taken_bytes() const { return taken_bytes_.load(); }

 private:
  std::atomic<std::size_t> max_bytes_;
  std::atomic<std::size_t> taken_bytes_ = 0;
};

}  // namespace atlas
