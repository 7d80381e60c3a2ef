// A number that one thread adds to and any thread may read: no lock, and no instruction that other
// cores wait for.
#pragma once

#include <atomic>
#include <cstdint>

namespace atlas {

class ThreadCounter {
 public:
  // By the one thread.
  void Add(std::uint64_t amount = 1) { value_.store(value() + amount, std::memory_order_relaxed); }
  void Subtract(std::uint64_t amount = 1) {
    value_.store(value() - amount, std::memory_order_relaxed);
  }

  std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_ = 0;
};

}  // namespace atlas
