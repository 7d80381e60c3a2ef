// Waiting until the fusion workers have caught up. Thread-safe. Every wait ends early with
// kUnavailable when the changes are closed, which is when the daemon ends, or on a stop; and late,
// with what keeps them from it, when the workers could not begin (FusionScheduler::start_problem).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <utility>

#include "core/base/status.h"
#include "server/service/change_signal.h"
#include "server/service/fusion/fusion_scheduler.h"
#include "server/store/atlas_store.h"

namespace atlas {

// Until when a call may wait and work, however often it is handed on, and what ends it earlier.
struct Patience {
  using Clock = std::chrono::steady_clock;

  Patience() = default;  // none: it looks once
  Patience(Clock::time_point latest, std::stop_token token)
      : deadline(latest), stop(std::move(token)) {}
  // From now on.
  Patience(Clock::duration timeout, std::stop_token token)
      : Patience(Clock::now() + timeout, std::move(token)) {}

  bool is_over() const { return Clock::now() >= deadline; }

  Clock::time_point deadline;
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
  FusionWait(AtlasStore& store, ChangeSignal& changes, const FusionScheduler& fusion)
      : store_(store), changes_(changes), fusion_(fusion), damage_(fusion.damage()) {}

  // Until nothing is dirty but what damage keeps from being fused.
  Result<WaitOutcome> UntilClean(const Patience& patience) const;
  // The same; kTimeout when it is not in time.
  Result<WaitOutcome> UntilCleanInTime(const Patience& patience) const;
  // Until the tiles reflect every change up to `revision`. kTimeout if they do not in time,
  // kInvalidData if damage keeps them from it, kInvalidArgument when the atlas has no such revision
  // yet, kNotFound when it is lost (StoreIdentity).
  Status ForRevision(std::uint64_t revision, const Patience& patience) const;

  // For long work to ask now and then: a failed status ends it. kTimeout, in the words of
  // `too_late`, when the time is up.
  std::function<Status()> Check(const Patience& patience, std::string too_late) const;

 private:
  // How a wait ended: done unless damage keeps it from that, or it was too late.
  struct End {
    DirtyState state;
    Status damage;
    bool is_timed_out = false;
  };

  Result<End> Until(const std::function<bool(const DirtyState&)>& is_done,
                    const Patience& patience) const;
  Status CheckRunning(const std::stop_token& stop) const;

  AtlasStore& store_;
  ChangeSignal& changes_;
  const FusionScheduler& fusion_;
  const DamageList& damage_;
};

}  // namespace atlas
