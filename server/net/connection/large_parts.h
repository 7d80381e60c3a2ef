// What has come of large frames that are not whole, or that wait to be read: all together no more
// than a part of what the daemon holds, so that there is always room for small ones. When that is
// full, whoever is closest to its deadline goes, not whoever comes. Thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <utility>

namespace atlas {

class LargeParts {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit LargeParts(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // Of one connection, for its thread. A lock is taken when it comes and when it goes, and while
  // there is no room.
  class Part {
   public:
    // `close`: from any thread, with a lock held; called once at most. `all` outlives this.
    Part(LargeParts& all, std::function<void()> close);
    Part(const Part&) = delete;
    Part& operator=(const Part&) = delete;
    ~Part();

    // So much of it, whose rest is expected until `deadline`; Time::max(): nobody is to wait for
    // it. False: there is no room, and it is the one that has to go.
    bool Set(std::size_t bytes, Time deadline);

   private:
    friend class LargeParts;

    LargeParts& all_;
    const std::function<void()> close_;
    std::atomic<std::size_t> bytes_ = 0;
    std::atomic<Time::rep> deadline_ = 0;
    bool is_closing_ = false;  // under the lock
  };

  std::size_t max_bytes() const { return max_bytes_; }
  std::size_t bytes() const { return bytes_.load(); }
  // How many had to go, since the start.
  std::uint64_t closed() const { return closed_.load(); }

 private:
  bool MakeRoom(const Part& newest);
  Part* Slowest() const;

  const std::size_t max_bytes_;
  std::atomic<std::size_t> bytes_ = 0;
  std::atomic<std::uint64_t> closed_ = 0;
  std::mutex mutex_;
  std::set<Part*> parts_;
};

}  // namespace atlas
