// Limits, looked at now and then.
#include "core/planning/plan_budget.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// The clock is asked once in so many expansions: some 0.1 ms.
constexpr std::uint64_t kExpansionsBetweenChecks = 256;

}  // namespace

PlanBudget::PlanBudget(const PlanOptions& options,
                       std::function<double()> now_s,
                       std::pmr::memory_resource* memory)
    : options_(options),
      now_s_(std::move(now_s)),
      memory_(memory != nullptr ? memory : std::pmr::new_delete_resource()) {
  if (now_s_) {
    end_s_ = now_s_() + options.max_time_s;
  }
}

Status PlanBudget::Check() {
  if (expansions_ > options_.max_expansions) {
    return Status(StatusCode::kResourceExhausted,
                  StrCat("plan: no route within the limit of ", options_.max_expansions,
                         " expansions; expected a nearer goal or a higher limit"));
  }
  next_check_ = std::min(expansions_ + kExpansionsBetweenChecks, options_.max_expansions + 1);
  return CheckTime();
}

Status PlanBudget::CheckTime() const {
  if (now_s_ && now_s_() > end_s_) {
    return Status(StatusCode::kTimeout,
                  StrCat("plan: no route within the limit of ", options_.max_time_s, " s, after ",
                         expansions_, " expansions"));
  }
  return {};
}

Status PlanBudget::AddMemory(std::size_t bytes) {
  memory_bytes_ += bytes;
  max_memory_seen_bytes_ = std::max(max_memory_seen_bytes_, memory_bytes_);
  if (memory_bytes_ > options_.max_memory_bytes) {
    return Status(StatusCode::kResourceExhausted,
                  StrCat("plan: needs more than the limit of ",
                         static_cast<double>(options_.max_memory_bytes) / (1 << 20),
                         " MiB of memory; expected a nearer goal or a higher limit"));
  }
  return {};
}

}  // namespace atlas
