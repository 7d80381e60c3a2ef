// What a plan may still cost: expansions, time and memory, counted over all of its searches, and
// where the memory comes from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory_resource>

#include "core/base/status.h"
#include "core/planning/plan_options.h"

namespace atlas {

class PlanBudget {
 public:
  // A clock in seconds that does not go back; empty: time has no limit. `options` and `memory`,
  // null: the heap, outlive the budget.
  PlanBudget(const PlanOptions& options,
             std::function<double()> now_s,
             std::pmr::memory_resource* memory);

  // kResourceExhausted beyond the limit of expansions, kTimeout beyond that of time.
  Status CountExpansion() {
    ++expansions_;
    return expansions_ < next_check_ ? Status() : Check();
  }
  // kTimeout beyond the limit of time.
  Status CheckTime() const;
  // kResourceExhausted beyond the limit of memory.
  Status AddMemory(std::size_t bytes);
  void ReleaseMemory(std::size_t bytes) { memory_bytes_ -= bytes; }
  std::pmr::memory_resource* memory() const { return memory_; }

  std::uint64_t expansions() const { return expansions_; }
  std::size_t max_memory_seen_bytes() const { return max_memory_seen_bytes_; }

 private:
  Status Check();

  const PlanOptions& options_;
  std::function<double()> now_s_;
  std::pmr::memory_resource* memory_;
  double end_s_ = 0.0;
  std::uint64_t expansions_ = 0;
  std::uint64_t next_check_ = 0;
  std::size_t memory_bytes_ = 0;
  std::size_t max_memory_seen_bytes_ = 0;
};

}  // namespace atlas
