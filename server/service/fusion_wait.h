// Waiting until the fusion workers have caught up. Thread-safe. Every wait ends early with
// kUnavailable when the changes are closed, which is when the daemon ends, or on a stop; and late,
// with what keeps them from it, when the workers could not begin (FusionScheduler::start_problem).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>

#include "core/base/status.h"
#include "server/service/change_signal.h"
#include "server/service/fusion/fusion_scheduler.h"
#include "server/store/atlas_store.h"

namespace atlas {

// How long a call may wait, and what ends it earlier.
struct Patience {
  std::chrono::milliseconds timeout{0};
  std::stop_token stop;
};

struct WaitOutcome {
  std::uint64_t revision = 0;
  std::uint64_t dirty_tiles = 0;
  bool is_timed_out = false;
  // kInvalidData when the tiles that are left cannot be fused: names what is damaged.
  Status damage;
};

class FusionWait {
 public:
  // The time of a call that may wait several times.
  class Limit {
   public:
    explicit Limit(const Patience& patience)
        : deadline(std::chrono::steady_clock::now() + patience.timeout), stop(patience.stop) {}

    bool is_over() const { return std::chrono::steady_clock::now() >= deadline; }

    const ChangeSignal::TimePoint deadline;
    const std::stop_token stop;
  };

  FusionWait(AtlasStore& store, ChangeSignal& changes, const FusionScheduler& fusion)
      : store_(store), changes_(changes), fusion_(fusion), damage_(fusion.damage()) {}

  // Until nothing is dirty but what damage keeps from being fused.
  Result<WaitOutcome> UntilClean(const Limit& limit) const;
  // The same; kTimeout when it is not in time.
  Result<WaitOutcome> UntilCleanInTime(const Limit& limit) const;
  // Until the tiles reflect every change up to `revision`. kTimeout if they do not in time,
  // kInvalidData if damage keeps them from it, kInvalidArgument when the atlas has no such revision
  // yet, kNotFound when it is lost (StoreIdentity).
  Status ForRevision(std::uint64_t revision, const Limit& limit) const;

  // For long work to ask now and then: a failed status ends it. kTimeout, in the words of
  // `too_late`, when the time is up.
  std::function<Status()> Check(const Limit& limit, std::string too_late) const;

 private:
  enum class End { kDone, kDamaged, kTimedOut };

  Result<End> Until(const std::function<bool(const DirtyState&)>& is_done,
                    const Limit& limit,
                    DirtyState& state) const;
  bool IsStuck(const DirtyState& state) const;
  Status CheckRunning(const std::stop_token& stop) const;

  AtlasStore& store_;
  ChangeSignal& changes_;
  const FusionScheduler& fusion_;
  const DamageList& damage_;
};

}  // namespace atlas
