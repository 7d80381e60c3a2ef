#include "client/merge/plan/parallel.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace atlas {

Status RunParallel(std::size_t count,
                   std::size_t workers,
                   const std::function<Status(std::size_t worker, std::size_t i)>& run) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  Status status;
  std::size_t failed = count;
  const auto work = [&](std::size_t worker) {
    for (std::size_t i = next++; i < count; i = next++) {
      Status one = run(worker, i);
      if (one.ok()) continue;
      const std::lock_guard lock(mutex);
      if (i < failed) {
        failed = i;
        status = std::move(one);
      }
      next = count;  // those before it are under way
    }
  };
  std::vector<std::jthread> threads;
  for (std::size_t worker = 1; worker < std::min(workers, count); ++worker) {
    threads.emplace_back(work, worker);
  }
  work(0);
  threads.clear();
  return status;
}

}  // namespace atlas
